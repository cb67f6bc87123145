"""Read the vertices of a Wavefront OBJ file.

Ours because Open3D 0.20 refuses an OBJ without faces, leaves out the vertices that no face uses,
and rounds to single precision.
"""

from __future__ import annotations

import re
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.table import parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array

#: The line of a vertex, up to what follows its "v". What `str.lstrip` takes away may be before it.
_VERTEX = re.compile(rb"^[\t\x0b\x0c\r\x1c-\x1f \x85\xa0]*v[ \t]([^\n]*)", re.MULTILINE)


def read_obj(path: Path) -> Array:
    """Read the vertices (N, 3): the lines that begin with ``v``.

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
        return _line_by_line(data.decode("latin-1"), columns, path)
    return parsed[0][:, :3]


def _line_by_line(text: str, columns: int, path: Path) -> Array:
    """The vertices of any file that has some, or what is wrong with them."""
    lines = [
        (number, line.lstrip()[1:])
        for number, line in enumerate(text.split("\n"), 1)
        if line.lstrip()[:2] in ("v ", "v\t")
    ]
    if columns < 3:
        raise InputError(f"{path}, line {lines[0][0]}: expected 'v X Y Z', got {columns} numbers")
    return parse_lines(lines, columns, path)[:, :3]
