"""Read the points of legacy VTK files.

Ours, as VTK's own package is large and the points of its files are simple.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.stations import Lines
from mvreg.io.table import excerpt, parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array

_TYPES = {
    "char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2", "int": "i4",
    "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "float": "f4", "double": "f8",
}  # fmt: skip
_KINDS = ("POLYDATA", "UNSTRUCTURED_GRID", "STRUCTURED_GRID")
_POINTS = re.compile(r"points\s+(\d{1,18})\s+(\w+)\s*", re.IGNORECASE)


def read_vtk(path: Path) -> Array:
    """Read the points (N, 3) of a POLYDATA, UNSTRUCTURED_GRID or STRUCTURED_GRID.

    Cells and data of points are not read.

    Raises
    ------
    InputError
        With file, line or byte, and reason.
    """
    data = path.read_bytes()
    lines = Lines(data, path)
    if not lines.peek().startswith("# vtk DataFile"):
        raise lines.error("'# vtk DataFile Version'")
    lines.next()
    lines.next()  # the title
    kind = lines.peek().strip().upper()
    if kind not in ("ASCII", "BINARY"):
        raise lines.error("ASCII or BINARY")
    lines.next()
    while (found := _POINTS.fullmatch(lines.peek())) is None:
        words = lines.peek().split()
        if (
            words
            and words[0].upper() == "DATASET"
            and words[1:2] != []
            and (words[1].upper() not in _KINDS)
        ):
            raise lines.error(f"DATASET {', '.join(_KINDS)}")
        if lines.at >= len(data):
            raise lines.error("a line 'POINTS COUNT TYPE'")
        lines.next()
    count, number = int(found[1]), found[2].lower()
    if number not in _TYPES:
        raise lines.error(f"POINTS of type {', '.join(_TYPES)}")
    if not count:
        raise InputError(f"{path}: the header announces no points; leave this file out")
    lines.next()
    return _binary(lines, count, number) if kind == "BINARY" else _ascii(lines, count)


def _binary(lines: Lines, count: int, number: str) -> Array:
    record = np.dtype(">" + _TYPES[number])
    left = len(lines.data) - lines.at
    if count * 3 * record.itemsize > left:
        raise InputError(
            f"{lines.path}, byte {len(lines.data)}: the file ends after "
            f"{left // (3 * record.itemsize)} of {count} points; it is truncated"
        )
    values = np.frombuffer(lines.data, record, 3 * count, lines.at)
    return values.reshape(-1, 3).astype(np.float64)


def _ascii(lines: Lines, count: int) -> Array:
    """Numbers may be broken into lines anywhere; VTK writes three points a line."""
    rest = lines.data[lines.at :]
    if count * 6 > len(rest) + 1:
        raise InputError(
            f"{lines.path}, line {lines.number}: {count} points are announced, but only "
            f"{len(rest)} bytes follow; the file is truncated or the number is wrong"
        )
    # Whatever follows the points begins with a word; that of another number is no letter's.
    end = re.search(rb"[\r\n][ \t]*(?!nan|inf)[A-Za-z]", rest, re.IGNORECASE)
    words = rest[: end.start() if end else len(rest)].split()
    if len(words) != 3 * count:
        raise InputError(
            f"{lines.path}, line {lines.number}: expected {count} points, {3 * count} numbers; "
            f"found {len(words)}, the last {excerpt(words[-1].decode('latin-1')) if words else ''}"
        )
    parsed = parse_rows(b"\n".join(words), 0, len(words), 1)
    if parsed is None:
        numbered = ((lines.number, word.decode("latin-1")) for word in words)
        table = parse_lines(numbered, 1, lines.path)
        if len(table) != 3 * count:
            raise lines.error(f"{count} points")
        return table.reshape(-1, 3)
    return parsed[0].reshape(-1, 3)
