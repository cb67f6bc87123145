"""The arrays of VTK's XML files: in text, in base64, or appended, compressed or not."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from mvreg.errors import InputError
from mvreg.io.table import as_declared, excerpt, parse_lines
from mvreg.io.vtk_xml_blocks import COMPRESSORS, Packing, from_base64, short
from mvreg.kernels.text import parse_rows
from mvreg.types.attributes import Values

TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4",
    "Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
_ORDERS = {"LittleEndian": "<", "BigEndian": ">"}
_HEADERS = {"UInt32": "u4", "UInt64": "u8"}
#: An array is at most so many times as large as the file, as of other compressed files, or small.
_RATIO, _SMALL = 100, 1 << 20


@dataclass(frozen=True, eq=False)
class Appended:
    """What follows the ``_`` of the appended data: bytes as they are if `raw`, or else base64.

    `offsets` are those of all arrays, sorted.
    """

    data: bytes = b""
    raw: bool = False
    offsets: Sequence[int] = ()

    def at(self, offset: int, where: str) -> memoryview:
        """The array that begins at `offset`, up to the next one."""
        place = bisect_right(self.offsets, offset)
        end = self.offsets[place] if place < len(self.offsets) else len(self.data)
        if self.raw:
            return memoryview(self.data)[offset:end]
        return from_base64(self.data[offset:end], where)


@dataclass(frozen=True, eq=False)
class Arrays:
    """The arrays of one file.

    Parameters
    ----------
    path : Path
    order : str
        Of their bytes: ``<`` or ``>``.
    packing : Packing
    appended : Appended
    """

    path: Path
    order: str
    packing: Packing
    appended: Appended

    @classmethod
    def of(cls, root: Element, appended: Appended, path: Path) -> Arrays:
        """As the element VTKFile says that they are.

        Raises
        ------
        InputError
            For a byte order or header that there is not, and a compressor that cannot be read.
        """
        order = root.get("byte_order", "LittleEndian")
        header, compressor = root.get("header_type", "UInt32"), root.get("compressor", "")
        for what, found, known in (("byte_order", order, [*_ORDERS]),
                                   ("header_type", header, [*_HEADERS]),
                                   ("compressor", compressor, ["", *COMPRESSORS])):  # fmt: skip
            if found not in known:
                raise InputError(
                    f"{path}: expected {what} {', '.join(filter(None, known))}; got "
                    f"{excerpt(found)}; write the file again with one of these"
                )
        most = max(_RATIO * path.stat().st_size, _SMALL)
        packing = Packing(_ORDERS[order] + _HEADERS[header], compressor, most)
        return cls(path, _ORDERS[order], packing, appended)

    def values(self, element: Element, count: int | None = None) -> Values:
        """The numbers (N, K) of a DataArray of K components; N = `count` where this is known.

        Raises
        ------
        InputError
            With file, array and reason; before anything is allocated for a count that the file is
            too small for.
        """
        where = f"{self.path}, array {excerpt(element.get('Name', ''))}"
        code = TYPES.get(element.get("type", ""))
        if code is None:
            raise InputError(
                f"{where}: expected type {', '.join(TYPES)}; got {element.get('type')!r}"
            )
        components = _whole(element.get("NumberOfComponents", "1"), where, 1, 64)
        found = self._read(element, code, where)
        if len(found) % components or (count is not None and len(found) != count * components):
            expected = "full rows" if count is None else f"{count} rows"
            raise InputError(
                f"{where}: expected {expected} of {components} numbers, found {len(found)} "
                "numbers; the file is truncated or damaged"
            )
        return found.reshape(-1, components)

    def _read(self, element: Element, code: str, where: str) -> Values:
        kind = element.get("format", "ascii").lower()
        if kind == "ascii":
            return _from_text(element.text or "", code, where)
        if kind == "binary":
            data = from_base64((element.text or "").encode(), where)
        elif kind == "appended":
            top = len(self.appended.data)
            data = self.appended.at(_whole(element.get("offset", ""), where, 0, top), where)
        else:
            raise InputError(f"{where}: expected format ascii, binary or appended; got {kind!r}")
        found = self.packing.unpack(data, where)
        if len(found) % int(code[1]):
            raise short(where, int(code[1]), len(found) % int(code[1]))
        return np.frombuffer(found, self.order + code).astype(code)


def _from_text(text: str, code: str, where: str) -> Values:
    words = text.encode().split()
    if not words:
        return np.empty(0, code)
    parsed = parse_rows(b"\n".join(words), 0, len(words), 1)
    if parsed is None:
        numbered = ((number, word.decode()) for number, word in enumerate(words, 1))
        table = parse_lines(numbered, 1, Path(f"{where}, a number each"))
    else:
        table = parsed[0]
    return as_declared(table[:, 0], np.dtype(code))


def _whole(word: str, where: str, least: int, most: int) -> int:
    """A whole number between two others."""
    good = word.isascii() and word.isdecimal() and len(word) < 16
    if not good or not least <= int(word) <= most:
        raise InputError(
            f"{where}: expected a number from {least} to {most}, got {excerpt(word)}; the file is "
            "truncated or damaged"
        )
    return int(word)
