"""Reference of `mvreg.kernels.grid`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array, Indices


def cells(points: Array, step: float) -> tuple[Indices, Array, Indices]:
    """Sizes (C,), means (C, 3) and the cell of each point (N,) of an aligned grid."""
    place = np.floor((points - points.min(axis=0)) / step).astype(np.int64)
    extent = place.max(axis=0) + 1
    keys = (place[:, 0] * extent[1] + place[:, 1]) * extent[2] + place[:, 2]
    unique, cell = np.unique(keys, return_inverse=True)
    sums = [np.bincount(cell, points[:, axis], len(unique)) for axis in range(3)]
    sizes = np.bincount(cell, minlength=len(unique))
    return sizes, np.stack(sums, axis=1) / sizes[:, None], cell
