"""The rows of a table of text, whatever is in them besides x, y and z."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.table import as_float, excerpt
from mvreg.io.text_layout import COMMENT, Layout
from mvreg.kernels.text import parse_rows
from mvreg.types import Array


def parse_table(body: bytes, number: int, layout: Layout, axes: Sequence[int], path: Path) -> Array:
    """Some rows (N, columns), whole lines, of which the first has a number.

    Clean tables are the kernel's; where it finds anything else, each line is looked at. Of a row
    only the columns `axes` must be there, and be numbers or say that there is none; NaN stands for
    what else is missing or no number.

    Raises
    ------
    InputError
        With file, line and reason.
    """
    body = body.rstrip(b" \t\n\0\x1a")
    if not body:
        return np.empty((0, layout.columns))
    if layout.is_plain:
        plain = _translated(body, layout)
        found = parse_rows(plain, 0, plain.count(b"\n") + 1, layout.columns)
        if found is not None:
            return found[0]
    return parse_lines(body, number, layout, axes, path)


def parse_lines(body: bytes, number: int, layout: Layout, axes: Sequence[int], path: Path) -> Array:
    """The same of rows that the kernel does not take, line by line."""
    rows = []
    blanks, plain_too = layout.blanks, layout.is_plain
    for at, raw in enumerate(body.split(b"\n"), number):
        line = raw.decode("utf-8", "replace").strip()
        if not line or line.startswith(COMMENT):
            continue
        row = _clean_row(line.translate(blanks), layout.columns) if plain_too else None
        rows.append(row or _row(line, at, layout, axes, path))
    return np.array(rows, dtype=np.float64).reshape(-1, layout.columns)


def _translated(body: bytes, layout: Layout) -> bytes:
    changes = {char: to for char, to in layout.blanks.items() if to is not None}
    table = bytearray(range(256))
    for char, to in changes.items():
        table[char] = ord(to)
    if all(table[i] == i for i in range(256)) and not layout.numbers.groups:
        return body
    return body.translate(bytes(table), layout.numbers.groups.encode("ascii"))


def _clean_row(line: str, columns: int) -> list[float] | None:
    """The numbers of a row of nothing but numbers, as the kernel reads it."""
    words = line.split()
    if len(words) != columns:
        return None
    values = [as_float(word) for word in words]
    return None if None in values else [value for value in values if value is not None]


def _row(line: str, number: int, layout: Layout, axes: Sequence[int], path: Path) -> list[float]:
    cells = layout.cells(line)
    needed = max(axes) + 1
    if len(cells) < needed or len(cells) > layout.columns == needed:
        exact = "" if layout.columns == needed else "at least "
        what = "numbers" if needed == 3 else "columns"
        raise InputError(
            f"{path}, line {number}: expected {exact}{needed} {what}, got {len(cells)}: "
            f"{excerpt(line)}"
        )
    values = [np.nan] * layout.columns
    for place, cell in enumerate(cells[: layout.columns]):
        value = None if place in layout.words else layout.numbers.value(cell)
        if value is not None:
            values[place] = value
        elif place in axes:
            raise InputError(f"{path}, line {number}: expected a number, got {excerpt(cell)}")
    return values
