"""Reference of `mvreg.kernels.descriptors`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array, Indices


def foreign(rows: Array, owners: Indices, which: Indices, count: int) -> tuple[Indices, Array]:
    """Owners of, and squared distances (Q, count) to, the nearest rows of other owners.

    -1 and infinity where there are not so many.
    """
    squared = ((rows[which, None] - rows[None]) ** 2).sum(axis=2)
    squared[owners[which, None] == owners[None]] = np.inf
    nearest = np.argsort(squared, axis=1, kind="stable")[:, :count]
    found: Array = np.take_along_axis(squared, nearest, axis=1)
    whose = np.where(np.isfinite(found), owners[nearest], -1)
    missing = ((0, 0), (0, count - nearest.shape[1]))
    return np.pad(whose, missing, constant_values=-1), np.pad(
        found, missing, constant_values=np.inf
    )
