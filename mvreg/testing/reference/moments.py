"""Reference of `mvreg.kernels.moments`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array


def moments(points: Array, keypoints: Array, radii: Array) -> tuple[Array, Array, Array]:
    """Moments of points (N, 3) around keypoints, for growing radii."""
    gaps = points[None] - keypoints[:, None]
    near = np.linalg.norm(gaps, axis=2)[:, None] <= np.asarray(radii)[None, :, None]
    weights = near.astype(np.float64)
    first = np.einsum("kln,knc->klc", weights, gaps)
    second = np.einsum("kln,knc,knd->klcd", weights, gaps, gaps)
    return weights.sum(axis=2), first, second


def normals(points: Array, queries: Array, count: int) -> Array:
    """Unit normals of planes through the nearest of points (N, 3) to queries (M, 3)."""
    far = np.linalg.norm(points[None] - queries[:, None], axis=2)
    nearby = points[np.argsort(far, axis=1, kind="stable")[:, :count]]
    nearby = nearby - nearby.mean(axis=1, keepdims=True)
    vectors: Array = np.linalg.eigh(np.swapaxes(nearby, 1, 2) @ nearby)[1][:, :, 0]
    return vectors
