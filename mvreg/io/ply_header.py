"""The header of a PLY file: tolerant of what files in the wild put there."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.names import USUAL
from mvreg.io.table import excerpt

#: PLY's names of scalar types, old and new, and NumPy's.
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4",
    "float64": "f8", "bool": "u1",
}  # fmt: skip
FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")


@dataclass(frozen=True)
class Property:
    """One property; `count` is the type of a list's length, None for a scalar."""

    name: str
    type: str
    count: str | None = None


@dataclass(frozen=True)
class Element:
    """One element: `count` records of `properties`."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def has_lists(self) -> bool:
        """Whether the records differ in length."""
        return any(p.count for p in self.properties)

    @property
    def scalars(self) -> tuple[Property, ...]:
        """The properties that are no lists; of several with one name the first."""
        first = {p.name: p for p in reversed(self.properties) if p.count is None}
        return tuple(p for p in self.properties if first.get(p.name) is p)


@dataclass(frozen=True)
class Header:
    """What the header says, and where the data begin: byte `size`, after `lines` lines."""

    format: str
    elements: tuple[Element, ...]
    size: int
    lines: int
    newline: bytes

    @property
    def vertex_index(self) -> int:
        """Where in `elements` the vertices are."""
        return [e.name for e in self.elements].index("vertex")


def code_of(kind: str, path: Path) -> str:
    """NumPy's code for the name of a scalar type, without the byte order.

    Raises
    ------
    InputError
        If there is no such type.
    """
    if kind not in TYPES:
        raise InputError(f"{path}: expected property types {', '.join(TYPES)}; got {kind!r}")
    return TYPES[kind]


def read_header(data: bytes, path: Path) -> Header:
    """Parse the header; comments, ``obj_info`` and words that mean nothing are passed over.

    Raises
    ------
    InputError
        With file, line and reason, also where there is no element ``vertex`` with x, y and z.
    """
    lines, size, newline = _header_lines(data, path)
    kind = ""
    elements: list[Element] = []
    for number, words in enumerate(lines, 1):
        where = f"{path}, line {number}"
        match words:
            case ["format", word, *_] if word in FORMATS:
                kind = word
            case ["format", *rest]:
                raise InputError(f"{where}: expected format {', '.join(FORMATS)}; got {rest}")
            case ["element", *rest]:
                elements.append(_element(rest, where))
            case ["property", *rest]:
                if not elements:
                    raise InputError(f"{where}: a property before the first element")
                last = elements[-1]
                grown = (*last.properties, _property(rest, where))
                elements[-1] = Element(last.name, last.count, grown)
    if not kind:
        raise InputError(f"{path}: expected a line 'format' in the header, found none")
    header = Header(kind, tuple(elements), size, len(lines), newline)
    _check_vertex(header, path)
    return header


def _header_lines(data: bytes, path: Path) -> tuple[list[list[str]], int, bytes]:
    start = re.match(rb"(?:\xef\xbb\xbf)?ply[ \t]*(\r\n|\n|\r)", data, re.IGNORECASE)
    if start is None:
        raise InputError(
            f"{path}, line 1: expected 'ply', got {excerpt(data[:12].decode('latin-1'))}"
        )
    # "\r" alone counts only where the first line ends so: binary data may begin with any byte.
    newline = b"\r" if start[1] == b"\r" else b"\n"
    lines, position = [["ply"]], start.end()
    while True:
        end = data.find(newline, position)
        stop = len(data) if end < 0 else end
        words = data[position:stop].decode("latin-1").split()
        if words:
            words[0] = words[0].lower()
        lines.append(words)
        if words == ["end_header"]:
            return lines, min(stop + 1, len(data)), newline
        if end < 0:
            raise InputError(f"{path}, line {len(lines)}: the file ends before 'end_header'")
        position = end + 1


def _element(words: list[str], where: str) -> Element:
    if len(words) < 2 or not re.fullmatch("[0-9]{1,18}", words[1]):
        raise InputError(f"{where}: expected 'element NAME COUNT', got {excerpt(' '.join(words))}")
    return Element(words[0].lower(), int(words[1]), ())


def _property(words: list[str], where: str) -> Property:
    match [words, [word.lower() for word in words]]:
        case [[_, _, _, name, *_], ["list", count, kind, *_]]:
            return Property(usual(name), kind, count)
        case [[_, name, *_], [kind, *_]] if kind != "list":
            return Property(usual(name), kind)
    raise InputError(f"{where}: expected 'property TYPE NAME', got {excerpt(' '.join(words))}")


def usual(name: str) -> str:
    """A name as written, but for those that others write in small letters."""
    return name.lower() if name.lower() in USUAL else name


def _check_vertex(header: Header, path: Path) -> None:
    names = [e.name for e in header.elements]
    if "vertex" not in names:
        raise InputError(f"{path}: expected an element 'vertex', found {names or 'none at all'}")
    vertex = header.elements[header.vertex_index]
    scalars = [p.name for p in vertex.properties if p.count is None]
    if not {"x", "y", "z"} <= set(scalars):
        raise InputError(f"{path}: expected vertices with x, y and z, found {scalars}")
    if vertex.count == 0:
        raise InputError(f"{path}: the header announces no vertices; leave this file out")
