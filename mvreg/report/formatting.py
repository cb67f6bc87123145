"""Format numbers, lengths and grades for display."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

#: A grade's word, in capitals where it must stand out without colours, and its colour.
GRADES = {"green": ("green", "green"), "amber": ("amber", "yellow"), "red": ("RED", "bold red")}
#: A confidence that would be rounded to 1 is not told as certainty.
ROUNDS_TO_ONE = 0.995


def number(value: float | None, form: str) -> str:
    """A number, or a dash where there is none."""
    return "-" if value is None else format(value, form)


def length(value: float | None, report: Mapping[str, Any]) -> str:
    """Thousandths of a millimetre; where the unit is unknown so is the size, and digits count."""
    return number(value, ".3f" if report.get("unit") == "mm" else ".4g")


def unit(report: Mapping[str, Any]) -> str:
    """The unit of length of a report by name."""
    return unit_name(str(report.get("unit") or "file"))


def unit_name(unit: str) -> str:
    """A data set's unit of length by name."""
    return "file units" if unit == "file" else unit


def confidence(value: float | None) -> str:
    """A probability with two decimals, never 1."""
    return ">0.99" if value is not None and value >= ROUNDS_TO_ONE else number(value, ".2f")


def count(items: int, word: str) -> str:
    """A number of things: ``1 scan``, ``2 scans``."""
    return f"{items} {word}{'' if items == 1 else 's'}"
