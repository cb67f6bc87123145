"""Reference of `mvreg.kernels.fit`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array


def fit(
    points: Array, samples: Array, axes: Array, count: int, ridge: float
) -> tuple[Array, Array, Array, Array, Array]:
    """Patches of second order through the nearest of points (N, 3) about each sample."""
    apart = np.linalg.norm(samples[:, None] - points[None], axis=2)
    near = points[np.argsort(apart, axis=1, kind="stable")[:, :count]]
    local = (near - samples[:, None]) @ np.swapaxes(axes, 1, 2)
    reach = np.sqrt((local[..., :2] ** 2).sum(axis=2).max(axis=1))
    unit = np.where(reach > 0, reach, 1.0)
    a, b = local[..., 0] / unit[:, None], local[..., 1] / unit[:, None]
    terms = np.stack([np.ones_like(a), a, b, a * a / 2, a * b, b * b / 2], axis=2)
    system = np.swapaxes(terms, 1, 2) @ terms / terms.shape[1] + ridge * np.eye(6)
    right = np.swapaxes(terms, 1, 2) @ local[..., 2:] / terms.shape[1]
    found = np.linalg.solve(system, right)[..., 0]
    slopes, bends = found[:, 1:3] / unit[:, None], found[:, 3:] / unit[:, None] ** 2
    return found[:, 0], slopes, bends, reach, np.hypot(a.mean(axis=1), b.mean(axis=1))


def distances(points: Array, rank: int) -> Array:
    """How far each point's neighbour of a rank is; the point itself has the rank 0."""
    apart: Array = np.sort(np.linalg.norm(points[:, None] - points[None], axis=2), axis=1)
    return apart[:, rank]
