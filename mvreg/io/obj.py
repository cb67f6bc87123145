"""Read the vertices of a Wavefront OBJ file.

Ours because Open3D 0.20 refuses an OBJ without faces, leaves out the vertices that no face uses,
and rounds to single precision.
"""

from __future__ import annotations

from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.table import parse, parse_lines
from mvreg.types import Array


def read_obj(path: Path) -> Array:
    """Read the vertices (N, 3): the lines that begin with ``v``.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    text = path.read_bytes().decode("latin-1")
    lines = [
        (number, line.lstrip()[1:])
        for number, line in enumerate(text.split("\n"), 1)
        if line.lstrip()[:2] in ("v ", "v\t")
    ]
    if not lines:
        raise InputError(f"{path}: expected lines 'v X Y Z', found none")
    columns = len(lines[0][1].split())
    if columns < 3:
        raise InputError(f"{path}, line {lines[0][0]}: expected 'v X Y Z', got {columns} numbers")
    table = parse([line for _, line in lines], columns)
    if table is None:
        table = parse_lines(lines, columns, path)
    return table[:, :3]
