"""Read points from plain text: XYZ, TXT, CSV, PTS, ASC."""

from __future__ import annotations

import re
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.table import excerpt, is_number, parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array

_COMMENT = ("#", "//", "%", "!")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


@dataclass(frozen=True)
class _Row:
    """The first row of numbers: its line's number, where it starts, and the line before it."""

    number: int
    start: int
    line: bytes
    columns: int
    heading: list[str]


def read_text(path: Path) -> Array:
    """Read a table with x, y and z in it.

    Columns may be parted by blanks, tabs, commas or semicolons; a decimal comma is understood
    where it cannot be mistaken. Lines before the first number are a header, and so is a lone
    number (the count in PTS files). The columns are those that the header calls x, y and z, or
    else the first three.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    row = _first_row(data, path)
    data = _blanks(data, row.line).rstrip(b" \t\n\0\x1a")
    parsed = parse_rows(data, row.start, data.count(b"\n", row.start) + 1, row.columns)
    if parsed is not None:
        table = parsed[0]
    else:
        lines = data[row.start :].decode("latin-1").split("\n")
        table = parse_lines(enumerate(lines, row.number), row.columns, path)
    return table[:, _axes(row.heading, row.columns)]


def _first_row(data: bytes, path: Path) -> _Row:
    """Find the first row of numbers."""
    heading: list[str] = []
    stream = BytesIO(data)
    for number, line in enumerate(stream, 1):
        text = line.decode("latin-1")
        words = _blanks(line, line).decode("latin-1").split()
        if not words:
            continue
        if words[0].startswith(_COMMENT) or not is_number(words[0]) or len(words) == 1:
            heading = re.split(r"[\s,;\"']+", text.strip().lstrip("#/%!").strip().strip("\"'"))
        elif len(words) >= 3:
            names = [word.lower() for word in heading]
            return _Row(number, stream.tell() - len(line), line, len(words), names)
        else:
            raise InputError(
                f"{path}, line {number}: expected at least 3 numbers, got {excerpt(text)}"
            )
    raise InputError(f"{path}: expected lines of at least 3 numbers, found none")


def _blanks(data: bytes, row: bytes) -> bytes:
    """The text with blanks between the columns, and a point for a decimal comma as in `row`."""
    words = row.decode("latin-1").split()
    comma = b";" in row and b"," in row
    comma |= len(words) >= 3 and all(map(_DECIMAL_COMMA.fullmatch, words[:3]))
    return data.translate(bytes.maketrans(b";,", b" ." if comma else b"  "))


def _axes(heading: list[str], columns: int) -> list[int]:
    if len(heading) == columns and {"x", "y", "z"} <= set(heading):
        return [heading.index(axis) for axis in "xyz"]
    return [0, 1, 2]
