"""Lists of unequal length, one after the other: part k of the rows is ``ends[k]:ends[k + 1]``."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Flags, Indices


def ends_of(sizes: Indices) -> Indices:
    """(K + 1,): where each of parts of these sizes (K,) begins, and where the last one ends."""
    return np.append(0, np.cumsum(sizes))


def picked(ends: Indices, chosen: Flags) -> tuple[Flags, Indices]:
    """Which rows (M,) the chosen parts have, and the ends of those parts by themselves."""
    sizes = np.diff(ends)
    return np.repeat(chosen, sizes), ends_of(sizes[chosen])
