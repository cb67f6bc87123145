"""Statistics of repeated measurements: ratios of medians, and fitted power laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.report.comparison.spread import Spread


def ratio(theirs: Spread | None, ours: Spread | None) -> float | None:
    """The ratio of the medians, theirs over ours; None where either is missing."""
    if theirs is None or ours is None or not ours.median > 0:
        return None
    return theirs.median / ours.median


@dataclass(frozen=True)
class Growth:
    """``cost = factor * size ** exponent``, fitted to all sizes; `last`: between the largest two.

    Where a fixed cost rules the small sizes the fit is flatter than what is to be expected further
    on, which `last` shows.
    """

    exponent: float
    factor: float
    last: float

    def at(self, size: float) -> float:
        """The cost that the fit predicts for a size."""
        return float(self.factor * size**self.exponent)


def growth(sizes: Sequence[float], costs: Sequence[float | None]) -> Growth | None:
    """Least squares in logarithms; None with fewer than two sizes, or costs that are not positive.

    Parameters
    ----------
    sizes, costs : sequences of float
        Costs may be None, for sizes that were not measured.
    """
    known = sorted((s, c) for s, c in zip(sizes, costs, strict=True) if c is not None and c > 0)
    if len({size for size, _ in known}) < 2:
        return None
    size, cost = np.log(np.array(known, dtype=float)).T
    exponent, offset = np.polyfit(size, cost, 1)
    last = (cost[-1] - cost[-2]) / (size[-1] - size[-2])
    return Growth(float(exponent), float(np.exp(offset)), float(last))
