"""Read legacy VTK files: points, their data, and the faces of meshes.

Ours, as VTK's own package is large, and meshio 5.3 reads no POLYDATA.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mvreg.errors import InputError, few
from mvreg.io.cloud import PointCloud
from mvreg.io.vtk_arrays import attributes_of
from mvreg.io.vtk_cells import LINES, POLYGON, STRIP, Cells, counted, surface
from mvreg.io.vtk_data import DATA, read_data, read_fields
from mvreg.io.vtk_words import Words
from mvreg.types import Array
from mvreg.types.attributes import Values

_KINDS = ("POLYDATA", "UNSTRUCTURED_GRID", "STRUCTURED_GRID")
#: Lists of cells, and the type of these.
_LISTS = {"VERTICES": 2, "LINES": LINES, "POLYGONS": POLYGON, "TRIANGLE_STRIPS": STRIP, "CELLS": 0}


@dataclass
class _Found:
    """What was read so far."""

    points: Array | None = None
    cells: list[Cells] = field(default_factory=list)
    kinds: Values | None = None
    attributes: dict[str, Values] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def read_vtk(path: Path) -> PointCloud:
    """Read a POLYDATA, UNSTRUCTURED_GRID or STRUCTURED_GRID, of version 1 to 5.1.

    Data of points become attributes; polygons, strips and flat cells become triangles. What is
    left out, data of cells and cells without a surface, a remark says.

    Raises
    ------
    InputError
        With file, line or byte, and reason.
    """
    words = Words(path.read_bytes(), path)
    _read_header(words)
    found = _Found()
    while section := words.section():
        name = section[0].upper()
        if name == "METADATA":
            words.skip_metadata()
        elif name in _SECTIONS:
            _SECTIONS[name](words, section, found)
        elif name in DATA:
            _read_data(words, section, found)
        else:
            raise words.error(f"one of {', '.join([*_SECTIONS, *DATA])}")
    if found.points is None:
        raise words.error("a line 'POINTS COUNT TYPE'")
    return _cloud(found, found.points, path)


def _read_header(words: Words) -> None:
    if not words.peek().startswith("# vtk DataFile"):
        raise words.error("'# vtk DataFile Version'")
    words.next()
    words.next()  # the title
    kind = words.peek().strip().upper()
    if kind not in ("ASCII", "BINARY"):
        raise words.error("ASCII or BINARY")
    words.binary = kind == "BINARY"
    words.next()


def _cloud(found: _Found, points: Array, path: Path) -> PointCloud:
    if found.kinds is not None and found.cells:
        last = replace(found.cells[-1], kinds=found.kinds)
        found.cells[-1] = last.checked(len(points), f"{path}, CELL_TYPES")
    faces, remarks = surface(found.cells)
    return PointCloud(
        points,
        attributes=found.attributes,
        triangles=faces,
        remarks=(*found.remarks, *remarks),
    )


def _count(words: Words, section: list[str], place: int, expected: str) -> int:
    if len(section) <= place or not (section[place].isdecimal() and len(section[place]) < 16):
        raise words.error(f"'{expected}'")
    return int(section[place])


def _dataset(words: Words, section: list[str], found: _Found) -> None:
    if section[1:2] == [] or section[1].upper() not in _KINDS:
        raise words.error(
            f"DATASET {', '.join(_KINDS)}; others are no scans, convert it to one of these"
        )
    words.next()


def _points(words: Words, section: list[str], found: _Found) -> None:
    count = _count(words, section, 1, "POINTS COUNT TYPE")
    if len(section) < 3 or found.points is not None:
        raise words.error("'POINTS COUNT TYPE' once")
    if not count:
        raise InputError(f"{words.path}: the header announces no points; leave this file out")
    words.next()
    values = words.numbers(3 * count, section[2], "coordinates")
    if len(values) != 3 * count:
        raise words.error("coordinates that are numbers")
    found.points = values.astype(np.float64).reshape(-1, 3)


def _cells(words: Words, section: list[str], found: _Found) -> None:
    """A list of cells: up to version 4.2 each with its size, then offsets and connectivity."""
    name, expected = section[0].upper(), f"{section[0].upper()} COUNT SIZE"
    count, size = _count(words, section, 1, expected), _count(words, section, 2, expected)
    words.next()
    where = f"{words.path}, {name}"
    if words.data.startswith(b"OFFSETS", words.at):  # not as words: what follows may be binary
        parts = []
        for part, length in (("OFFSETS", count), ("CONNECTIVITY", size)):
            line = words.section()
            if line[:1] != [part] or len(line) < 2:
                raise words.error(f"'{part} TYPE'")
            words.next()
            parts.append(words.numbers(length, line[1], part.lower()).astype(np.int64))
        cells = Cells(parts[1], parts[0][1:], _LISTS[name])
    else:
        numbers = words.numbers(size, "int", "corners of cells")
        cells = Cells(*counted(numbers, count, where), _LISTS[name])
    points = 0 if found.points is None else len(found.points)
    found.cells.append(cells.checked(points, where))


def _cell_types(words: Words, section: list[str], found: _Found) -> None:
    count = _count(words, section, 1, "CELL_TYPES COUNT")
    words.next()
    found.kinds = words.numbers(count, "int", "types of cells").astype(np.int64)


def _skip_dimensions(words: Words, section: list[str], found: _Found) -> None:
    words.next()


def _skip_fields(words: Words, section: list[str], found: _Found) -> None:
    names = [each.name for each in read_fields(words, section)]
    found.remarks.append(f"left out data of the whole file: {few(names)}")


def _read_data(words: Words, section: list[str], found: _Found) -> None:
    count = _count(words, section, 1, f"{section[0]} COUNT")
    of_points = section[0].upper() == "POINT_DATA"
    if of_points and (found.points is None or count != len(found.points)):
        have = 0 if found.points is None else len(found.points)
        raise words.error(f"POINT_DATA {have}, as many as there are POINTS before it")
    words.next()
    arrays, left_out = read_data(words, count)
    if of_points:
        found.attributes |= attributes_of(arrays)
    else:
        left_out += [each.name for each in arrays]
    if left_out:
        of = "points" if of_points else "cells"
        found.remarks.append(f"left out data of {of}: {few(left_out)}")


_SECTIONS: dict[str, Callable[[Words, list[str], _Found], None]] = {
    "DATASET": _dataset, "POINTS": _points, **dict.fromkeys(_LISTS, _cells),
    "CELL_TYPES": _cell_types, "DIMENSIONS": _skip_dimensions, "FIELD": _skip_fields,
}  # fmt: skip
