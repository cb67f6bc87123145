"""Targets of the default method on unordered scans: medians over 20 random orders."""

from __future__ import annotations

from dataclasses import dataclass

#: How many orders are drawn of each set.
ORDERS = 20


@dataclass(frozen=True)
class Goal:
    """Targets for one data set of `scans` scans: upper bounds of e_R, e_t (mm) and pairs per scan.

    The bounds on the errors are slightly above the errors of the poses at which the scans fit best
    (``floor.md``): smaller errors would measure the ground truth and not the method.
    """

    scans: int
    rotation: float
    translation: float
    pairs: float = 1.3


GOALS = {
    "bunny": Goal(10, 0.0045, 0.30),
    "dragon": Goal(15, 0.0080, 1.65),
    "buddha": Goal(15, 0.0090, 1.65),
}
