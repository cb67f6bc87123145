"""Median and range of a quantity over several runs."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Spread:
    """Summary of `count` values, from `least` to `most`."""

    median: float
    least: float
    most: float
    count: int

    def shown(self, form: str, of: str = "") -> str:
        """The median and what it is `of`; the least and the most, too, where they read otherwise.

        ``"2.0 (1.0 to 3.0)"``, ``"9/10 (8 to 10)"``.
        """
        middle, least, most = (f"{v:{form}}" for v in (self.median, self.least, self.most))
        return f"{middle}{of}" if least == most else f"{middle}{of} ({least} to {most})"


def spread(values: Iterable[float | None]) -> Spread | None:
    """Of the values that are known; None where there are none."""
    known = [float(v) for v in values if v is not None and math.isfinite(v)]
    if not known:
        return None
    return Spread(statistics.median(known), min(known), max(known), len(known))
