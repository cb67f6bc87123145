"""Read points from plain text: XYZ, TXT, CSV, PTS, ASC."""

from __future__ import annotations

import re
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.table import excerpt, is_number, parse, parse_lines
from mvreg.types import Array

_COMMENT = ("#", "//", "%", "!")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


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
    text = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").decode("latin-1")
    first, columns, heading = _first_row(text.split("\n"), path)
    text = _blanks(text, text.split("\n")[first])
    lines = text.rstrip(" \t\n\0\x1a").split("\n")[first:]
    table = parse(lines, columns)
    if table is None:
        table = parse_lines(enumerate(lines, first + 1), columns, path)
    return table[:, _axes(heading, columns)]


def _first_row(lines: list[str], path: Path) -> tuple[int, int, list[str]]:
    """The index of the first row of numbers, how many there are, and the line before it."""
    heading: list[str] = []
    for index, line in enumerate(lines):
        words = _blanks(line, line).split()
        if not words:
            continue
        if words[0].startswith(_COMMENT) or not is_number(words[0]) or len(words) == 1:
            heading = re.split(r"[\s,;\"']+", line.strip().lstrip("#/%!").strip().strip("\"'"))
        elif len(words) >= 3:
            return index, len(words), [word.lower() for word in heading]
        else:
            raise InputError(
                f"{path}, line {index + 1}: expected at least 3 numbers, got {excerpt(line)}"
            )
    raise InputError(f"{path}: expected lines of at least 3 numbers, found none")


def _blanks(text: str, row: str) -> str:
    """The text with blanks between the columns, and a point for a decimal comma as in `row`."""
    words = row.split()
    comma = ";" in row and "," in row
    comma |= len(words) >= 3 and all(map(_DECIMAL_COMMA.fullmatch, words[:3]))
    return text.translate(str.maketrans(";,", " ." if comma else "  "))


def _axes(heading: list[str], columns: int) -> list[int]:
    if len(heading) == columns and {"x", "y", "z"} <= set(heading):
        return [heading.index(axis) for axis in "xyz"]
    return [0, 1, 2]
