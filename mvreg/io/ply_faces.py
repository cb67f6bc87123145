"""The faces of a PLY file, cut into triangles."""

from __future__ import annotations

import struct

import numpy as np

from mvreg.io.faces import fan, fan_table
from mvreg.io.ply_binary import STRUCT
from mvreg.io.ply_header import TYPES, Element, Header
from mvreg.types.attributes import Values

_LISTS = ("vertex_indices", "vertex_index")


def read_triangles(data: bytes, header: Header) -> Values | None:
    """The triangles (M, 3) of the element ``face``, as indices of vertices.

    None where there are no faces, and where they cannot be read: the vertices do without them.
    Indices may be out of range.
    """
    names = [element.name for element in header.elements]
    if "face" not in names or any(
        element.has_lists for element in header.elements[: names.index("face")]
    ):
        return None
    at = names.index("face")
    face, before = header.elements[at], header.elements[:at]
    lists = [p for p in face.properties if p.count and p.name in _LISTS]
    if not lists or face.count > len(data) - header.size:
        return None
    try:
        if header.format == "ascii":
            lines = sum(element.count for element in before)
            return _ascii(data[header.size :], lines, face, header)
        size = sum(
            element.count * sum(int(TYPES[p.type][1]) for p in element.properties)
            for element in before
        )
        order = "<" if header.format == "binary_little_endian" else ">"
        start = header.size + size
        alike = _binary_alike(data, start, face, order)
        return _binary(data, start, face, order) if alike is None else alike
    except (KeyError, ValueError, IndexError, struct.error, OverflowError):
        return None


def _ascii(data: bytes, before: int, face: Element, header: Header) -> Values | None:
    text = data.replace(b"\r", b"\n") if header.newline == b"\r" else data
    lines = [line for line in text.split(b"\n") if line.strip()][before : before + face.count]
    if len(lines) < face.count:
        return None
    polygons: list[list[int]] = []
    for line in lines:
        words = line.split()
        position = 0
        for each in face.properties:
            if each.count is None:
                position += 1
                continue
            size = int(words[position])
            if size < 0 or position + 1 + size > len(words):
                return None
            if each.name in _LISTS:
                polygons.append([int(word) for word in words[position + 1 : position + 1 + size]])
            position += 1 + size
    return fan(polygons)


def _binary_alike(data: bytes, start: int, face: Element, order: str) -> Values | None:
    """The faces of a file that has one list for each, all as long as the first; else None."""
    lists = [p for p in face.properties if p.count]
    if len(lists) != 1 or face.properties[0] is not lists[0] or not face.count:
        return None
    kind, item = order + TYPES[lists[0].count or ""], order + TYPES[lists[0].type]
    first = int(np.frombuffer(data, kind, 1, start)[0])
    if not 3 <= first <= 64:
        return None
    fields: list[tuple[str, object]] = [("size", kind), ("corners", (item, first))]
    fields += [(f"more{i}", order + TYPES[p.type]) for i, p in enumerate(face.properties[1:])]
    record = np.dtype(fields)
    if start + face.count * record.itemsize > len(data):
        return None
    table = np.frombuffer(data, record, face.count, start)
    if np.any(table["size"] != first):
        return None
    return fan_table(table["corners"].astype(np.int64))


def _binary(data: bytes, start: int, face: Element, order: str) -> Values | None:
    polygons: list[list[int]] = []
    for _ in range(face.count):
        for each in face.properties:
            code = TYPES[each.type]
            if each.count is None:
                start += int(code[1])
                continue
            kind = TYPES[each.count]
            (size,) = struct.unpack_from(order + STRUCT[kind], data, start)
            start += int(kind[1])
            if not 0 <= size * int(code[1]) <= len(data) - start:
                return None
            if each.name in _LISTS:
                corners = struct.unpack_from(f"{order}{int(size)}{STRUCT[code]}", data, start)
                polygons.append([int(corner) for corner in corners])
            start += int(size) * int(code[1])
    return fan(polygons)
