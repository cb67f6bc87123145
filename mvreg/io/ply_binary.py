"""The vertices of a binary PLY file, with their scalar properties."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.io.ply_header import Element, Header, code_of
from mvreg.types.attributes import Values

#: NumPy's codes and those of `struct`.
STRUCT = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q",
           "u8": "Q", "f4": "f", "f8": "d"}  # fmt: skip


def read_binary(data: bytes, header: Header, path: Path) -> dict[str, Values]:
    """Read the scalar properties of the vertices, each (N,), of either byte order.

    Raises
    ------
    InputError
        With file, byte and reason.
    """
    order = "<" if header.format == "binary_little_endian" else ">"
    body = _Body(data, order, path)
    at = header.vertex_index
    vertex = header.elements[at]
    offset = header.size
    for element in header.elements[:at]:
        offset = body.skip(element, offset)
    if vertex.has_lists:
        rows = [row for row, _ in body.walk(vertex, offset)]
        return {
            p.name: np.array([row[p.name] for row in rows], dtype=code_of(p.type, path))
            for p in vertex.scalars
        }
    last = not any(e.count for e in header.elements[at + 1 :])
    return body.table(vertex, offset, last)


def record_of(vertex: Element, order: str, path: Path) -> np.dtype[Any]:
    """The scalar properties within a record of vertices without lists, of a byte order."""
    codes = [code_of(p.type, path) for p in vertex.properties]
    starts = np.cumsum([0, *(int(code[1]) for code in codes)]).tolist()
    names = [p.name for p in vertex.properties]
    kept = [names.index(p.name) for p in vertex.scalars]
    return np.dtype(
        {
            "names": [names[i] for i in kept],
            "formats": [order + codes[i] for i in kept],
            "offsets": [starts[i] for i in kept],
            "itemsize": starts[-1],
        }
    )


def native(table: Values) -> dict[str, Values]:
    """The fields of records (N,), each by itself in the byte order of the machine."""
    return {
        name: table[name].astype(table.dtype[name].newbyteorder("="))
        for name in table.dtype.names or ()
    }


@dataclass(frozen=True)
class _Body:
    """The bytes of a file, their order ("<" or ">"), and its name for the errors."""

    data: bytes
    order: str
    path: Path

    def table(self, vertex: Element, offset: int, last: bool) -> dict[str, Values]:
        """The vertices, where all records have one size."""
        record = record_of(vertex, self.order, self.path)
        left = len(self.data) - offset - vertex.count * record.itemsize
        if left < 0:
            raise self._truncated((len(self.data) - offset) // record.itemsize, vertex)
        # A few stray bytes at the end are fine, whole records are points that would be lost.
        if last and left and left % record.itemsize == 0:
            raise InputError(
                f"{self.path}, byte {len(self.data) - left}: expected the end of the file after "
                f"{vertex.count} vertices, got {left} more bytes; the header's count is wrong"
            )
        table = np.frombuffer(self.data, record, vertex.count, offset)
        return native(table)

    def skip(self, element: Element, offset: int) -> int:
        """The byte after an element that is of no interest."""
        if not element.has_lists:
            sizes = [int(code_of(p.type, self.path)[1]) for p in element.properties]
            return offset + sum(sizes) * element.count
        for _, end in self.walk(element, offset):
            offset = end
        return offset

    def walk(self, element: Element, offset: int) -> Iterator[tuple[dict[str, float], int]]:
        """Step through records of varying size: their scalars, and the byte after each."""
        steps = [
            (p.name, struct.Struct(self.order + STRUCT[code_of(p.count or p.type, self.path)]),
             int(code_of(p.type, self.path)[1]) if p.count else 0)
            for p in element.properties
        ]  # fmt: skip
        for done in range(element.count):
            values: dict[str, float] = {}
            for name, item, list_item in steps:
                if offset + item.size > len(self.data):
                    raise self._truncated(done, element)
                (value,) = item.unpack_from(self.data, offset)
                offset += item.size
                if not list_item:
                    values.setdefault(name, value)
                elif 0 <= value <= len(self.data):
                    offset += int(value) * list_item
                else:
                    raise InputError(
                        f"{self.path}, byte {offset - item.size}: expected the length of a list "
                        f"in {element.name} {done}, got {value}"
                    )
            if offset > len(self.data):
                raise self._truncated(done, element)
            yield values, offset

    def _truncated(self, found: int, element: Element) -> InputError:
        return InputError(
            f"{self.path}, byte {len(self.data)}: the file ends after {max(found, 0)} of "
            f"{element.count} records of {element.name}; it is truncated"
        )
