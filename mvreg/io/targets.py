"""Read tables of targets: names, perhaps the scans that saw them, and coordinates."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mvreg.errors import InputError, few
from mvreg.io.table import as_float, excerpt
from mvreg.io.utf8 import read_utf8
from mvreg.types import Array
from mvreg.types.column_names import axes_named, clean

#: What the columns of names and of scans are called, in small letters.
NAMES = ("name", "target", "point", "id", "nr", "no", "number", "label", "point id", "pointid",
         "target id", "punktnummer", "punkt", "pkt")  # fmt: skip
SCANS = ("scan", "station", "file", "setup", "scanner position", "scanpos")


@dataclass(frozen=True, eq=False)
class Target:
    """A row: a name, the scan whose frame the position (3,) is in, empty for none, and the line."""

    name: str
    scan: str
    position: Array
    line: int


def read_targets(path: str | Path) -> list[Target]:
    """Read a table of targets.

    Columns are parted by commas, semicolons, tabs or blanks, and called as in tables of points; a
    decimal comma will do where another character parts them. Without a heading they are the name,
    the scan if there are five, and x, y, z (or easting, northing, height). Lines that begin with
    ``#`` and blank ones do not count.

    Raises
    ------
    InputError
        With file, line and reason; also where a target is there twice in the same frame.
    """
    path = Path(path)
    lines = [(number, line) for number, line in enumerate(read_utf8(path).splitlines(), 1)
             if line.strip() and not line.lstrip().startswith("#")]  # fmt: skip
    rows = [(number, _cells(line, number, path)) for number, line in lines]
    if not rows:
        raise InputError(f"{path}: expected targets, a name and x, y, z in each line; found none")
    columns, has_heading = _columns(rows[0][1], path)
    found = [_target(cells, columns, number, path) for number, cells in rows[has_heading:]]
    seen: dict[tuple[str, str], int] = {}
    for target in found:
        before = seen.setdefault((target.name, target.scan), target.line)
        if before != target.line:
            raise InputError(
                f"{path}, line {target.line}: target {target.name!r} is in line {before}, too"
            )
    return found


def _cells(line: str, number: int, path: Path) -> list[str]:
    words = line.split()
    decimal = all(_number(word) is not None and not word.endswith(",") for word in words[-3:])
    for separator in "\t;" if len(words) > 3 and decimal else "\t;,":
        if separator in line:
            try:
                return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
            except csv.Error as error:
                raise InputError(f"{path}, line {number}: no row of a table: {error}") from error
    return words


def _columns(first: Sequence[str], path: Path) -> tuple[tuple[int, int | None, list[int]], bool]:
    """Where name, scan and coordinates are, and whether the first row says so."""
    if len(first) >= 4 and all(_number(cell) is not None for cell in first[-3:]):
        scan = 1 if len(first) == 5 else None
        return (0, scan, list(range(len(first) - 3, len(first)))), False
    words = [clean(cell).lower() for cell in first]
    axes = axes_named(first)
    name = next((words.index(word) for word in NAMES if word in words), None)
    if axes is None or name is None:
        raise InputError(
            f"{path}: expected columns name, x, y and z, and scan where these are in the frame of "
            f"one; found {few(list(first))}"
        )
    return (name, next((words.index(w) for w in SCANS if w in words), None), list(axes)), True


def _target(
    cells: Sequence[str], columns: tuple[int, int | None, list[int]], line: int, path: Path
) -> Target:
    name, scan, axes = columns
    wanted = [name, *axes, *([] if scan is None else [scan])]
    numbers = [_number(cells[axis]) for axis in axes] if max(wanted) < len(cells) else [None]
    if not all(number is not None for number in numbers) or not cells[name]:
        raise InputError(
            f"{path}, line {line}: expected a name and three numbers, got "
            f"{excerpt(' '.join(cells))}"
        )
    position = np.array(numbers, dtype=np.float64)
    return Target(cells[name], "" if scan is None else cells[scan], position, line)


def _number(cell: str) -> float | None:
    found = as_float(cell.replace(",", "."))
    return None if found is None or not np.isfinite(found) else found
