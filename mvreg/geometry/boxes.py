"""Axis-aligned boxes: which of many come near each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.geometry.arrays import Array


def near_boxes(clouds: Sequence[Array], reach: float) -> list[tuple[int, int]]:
    """Pairs i < j of clouds (N, 3) whose boxes come within `reach` (length) of each other.

    A sweep along the first axis; the other two are asked only of those that meet on it, so that
    the time goes with the number of pairs that do.
    """
    low, high = ([end(cloud, axis=0) for cloud in clouds] for end in (np.min, np.max))
    return boxes_within(low, high, reach)


def boxes_within(
    lowest: Sequence[Array], highest: Sequence[Array], reach: float
) -> list[tuple[int, int]]:
    """Pairs i < j of boxes that come within `reach` of each other."""
    low, high = np.stack(lowest) - reach / 2, np.stack(highest) + reach / 2
    order = np.argsort(low[:, 0], kind="stable")
    ends = np.searchsorted(low[order, 0], high[order, 0], side="right")
    found = []
    for place, i in enumerate(order):
        others = order[place + 1 : ends[place]]
        meet = (low[others] <= high[i]).all(axis=1) & (low[i] <= high[others]).all(axis=1)
        found += [(int(min(i, j)), int(max(i, j))) for j in others[meet]]
    return sorted(found)
