"""Faces cut into triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.types.attributes import Values


def fan(polygons: Sequence[Sequence[int]]) -> Values | None:
    """Triangles (M, 3) of polygons, from the first corner of each; None where there are none.

    What has fewer than three corners, points and edges, does not count.
    """
    triangles = [
        (corners[0], corners[i], corners[i + 1])
        for corners in polygons
        for i in range(1, len(corners) - 1)
    ]
    return np.array(triangles, dtype=np.int64) if triangles else None


def fan_table(corners: Values) -> Values | None:
    """The same of polygons (F, K) with as many corners each."""
    size = corners.shape[1]
    if size < 3 or not len(corners):
        return None
    parts = [corners[:, [0, i, i + 1]] for i in range(1, size - 1)]
    return np.stack(parts, axis=1).reshape(-1, 3)
