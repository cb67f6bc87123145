"""Tables of numbers in text, line by line, and exact about the line where something is wrong.

Clean tables are `mvreg.kernels.text`'s; what it does not take comes here.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.types import Array
from mvreg.types.attributes import Values

#: How C libraries, Microsoft's above all, print what is not a number: "-1.#IND", "nan(ind)".
_ODD_NAN = re.compile(r"[+-]?(\d\.#\w+|nan(\(\w*\))?)", re.IGNORECASE)


def parse_lines(
    lines: Iterable[tuple[int, str]], columns: int, path: Path, most: int | None = None
) -> Array:
    """Parse a table line by line, and say where it is wrong.

    Blank lines and comments (``#``, ``//``) are passed over.

    Parameters
    ----------
    lines : iterable of (line number, text)
        No more are looked at once `most` (at least 1) rows are there.
    columns : int
        Words per line.

    Returns
    -------
    (M, columns) array

    Raises
    ------
    InputError
        With file, line and reason.
    """
    numbers = array("d")  # lists of floats would take four times as much
    rows = 0
    for number, line in lines:
        words = line.split()
        if not words or words[0].startswith(("#", "//")):
            continue
        if len(words) != columns:
            raise InputError(
                f"{path}, line {number}: expected {columns} numbers, got {len(words)}: "
                f"{excerpt(line)}"
            )
        numbers.extend(_number(word, number, path) for word in words)
        rows += 1
        if rows == most:
            break
    return np.array(numbers, dtype=np.float64).reshape(-1, columns)


def as_declared(column: Array, kind: np.dtype[Any]) -> Values:
    """A column of text in the whole type that a header declares, if all its numbers fit there.

    Colours are often written as fractions under a byte's type: what does not fit stays a double,
    as does what is declared with fewer digits than are written.
    """
    if kind.kind == "f":
        return column
    limits = np.iinfo(kind)
    fits = (column == np.rint(column)) & (column >= limits.min) & (column <= limits.max)
    return column.astype(kind) if fits.all() else column


def is_number(word: str) -> bool:
    """Whether a word reads as a number, NaN and infinity included."""
    return as_float(word) is not None


def excerpt(line: str) -> str:
    """The beginning of a line, safe to show."""
    line = line.strip()
    return repr(line if len(line) <= 40 else line[:40] + "...")


def _number(word: str, line: int, path: Path) -> float:
    value = as_float(word)
    if value is None:
        raise InputError(f"{path}, line {line}: expected a number, got {excerpt(word)}")
    return value


def as_float(word: str) -> float | None:
    """The number that a word is, as `float` and C libraries write it; None for other words."""
    try:
        return None if "_" in word else float(word)
    except ValueError:
        return np.nan if _ODD_NAN.fullmatch(word) else None
