"""How the numbers of a table are written: what marks decimals, what parts thousands."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mvreg.io.table import as_float

_BOTH = re.compile(r"[+-]?[\d.,'\s]*\d[\d.,'\s]*([eE][+-]?\d+)?")
_GROUPED = re.compile(r"[+-]?\d{1,3}([,.'\s]\d{3})+([.,]\d*)?([eE][+-]?\d+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?")
#: Words for "no number", as programs for tables write them.
MISSING = frozenset(["", "-", "--", "na", "n/a", "null", "none", "nil", "?"])


@dataclass(frozen=True)
class Numbers:
    """How numbers are written.

    Parameters
    ----------
    decimal : str
        A point or a comma.
    groups : str
        The characters that part thousands.
    """

    decimal: str = "."
    groups: str = ""

    def plain(self, cell: str) -> str:
        """A cell as `float` would read it."""
        for group in self.groups:
            cell = cell.replace(group, "")
        return cell.replace(self.decimal, ".") if self.decimal != "." else cell

    def value(self, cell: str) -> float | None:
        """The number in a cell, NaN where it says that there is none; None for other words."""
        found = as_float(self.plain(cell))
        return np.nan if found is None and cell.strip().lower() in MISSING else found


def may_hold_commas(word: str) -> bool:
    """Whether a word with commas in it may be one number: 1,5 or 18,297.21."""
    return bool(_DECIMAL_COMMA.fullmatch(word) or _GROUPED.fullmatch(word))


def numbers_in(cells: Iterable[str]) -> Numbers:
    """How the numbers among cells are written, as far as these tell.

    Of a point and a comma in one number the last marks the decimals. Where numbers have commas
    alone, these mark decimals, unless one has several: surveyors write millimetres, hardly anybody
    parts the thousands of whole metres.
    """
    found = [cell for cell in cells if _BOTH.fullmatch(cell)]
    groups = {char for cell in found for char in "' \xa0\u2009\u202f" if char in cell}
    grouped = [cell for cell in found if _GROUPED.fullmatch(cell)]
    if not grouped:
        groups = set()
    both = [cell for cell in found if "," in cell and "." in cell]
    decimal = "."
    if both:
        decimal = "," if both[0].rfind(",") > both[0].rfind(".") else "."
        groups.add("." if decimal == "," else ",")
    elif any(cell.count(",") > 1 for cell in grouped):
        groups.add(",")
    elif any("," in cell for cell in found):
        decimal = ","
        if any(cell.count(".") > 1 for cell in grouped):
            groups.add(".")
    return Numbers(decimal, "".join(sorted(groups)))
