"""What the default method is to reach on unordered scans, as medians over 20 random orders."""

from __future__ import annotations

from dataclasses import dataclass

#: How many orders are drawn of each set.
ORDERS = 20


@dataclass(frozen=True)
class Goal:
    """Of one data set: its number of `scans`, and the largest e_R, e_t (mm) and pairs per scan.

    The errors are a little above those of the poses where the scans fit each other best
    (``floor.md``): below, the errors measure the truth and not the method.
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
