"""Read the vertices and faces of a Wavefront OBJ file.

Ours because Open3D 0.20 refuses an OBJ without faces, leaves out the vertices that no face uses,
and rounds to single precision.
"""

from __future__ import annotations

import re
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.faces import fan
from mvreg.io.table import parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array
from mvreg.types.attributes import Values
from mvreg.types.colours import as_bytes, colours

#: The line of a vertex, up to what follows its "v". What `str.lstrip` takes away may be before it.
_VERTEX = re.compile(rb"^[\t\x0b\x0c\r\x1c-\x1f \x85\xa0]*v[ \t]([^\n]*)", re.MULTILINE)

#: The line of a vertex or a face.
_LINE = re.compile(rb"^[ \t]*([vf])[ \t]([^\n]*)", re.MULTILINE)


def read_obj(path: Path) -> PointCloud:
    """Read the vertices (N, 3), the lines that begin with ``v``, and the faces, with ``f``.

    Colours are taken from vertices of six numbers, ``v X Y Z R G B``. Faces with corners that are
    not there do not count.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    data = path.read_bytes()
    rows = _VERTEX.findall(data)
    if not rows:
        raise InputError(f"{path}: expected lines 'v X Y Z', found none")
    columns = len(rows[0].decode("latin-1").split())
    parsed = parse_rows(b"\n".join(rows), 0, len(rows), columns)
    if parsed is None or columns < 3:
        table = _line_by_line(data.decode("latin-1"), columns, path)
    else:
        table = parsed[0]
    return PointCloud(table[:, :3], attributes=_colours(table), triangles=_triangles(data))


def _colours(table: Array) -> dict[str, Values]:
    """From 0 to 1 or to 255."""
    return colours(as_bytes(table[:, 3:6])) if table.shape[1] >= 6 else {}


def _triangles(data: bytes) -> Values | None:
    """The faces, by index; of their corners ``v/vt/vn`` only the first number is of use."""
    polygons: list[list[int]] = []
    vertices = 0
    for kind, rest in _LINE.findall(data):
        if kind == b"v":
            vertices += 1
            continue
        try:
            corners = [int(word.partition(b"/")[0]) for word in rest.split()]
        except ValueError:
            continue
        polygons.append([i - 1 if i > 0 else vertices + i for i in corners])
    return fan(polygons)


def _line_by_line(text: str, columns: int, path: Path) -> Array:
    """The vertices of any file that has some, or what is wrong with them."""
    lines = [
        (number, line.lstrip()[1:])
        for number, line in enumerate(text.split("\n"), 1)
        if line.lstrip()[:2] in ("v ", "v\t")
    ]
    if columns < 3:
        raise InputError(f"{path}, line {lines[0][0]}: expected 'v X Y Z', got {columns} numbers")
    return parse_lines(lines, columns, path)
