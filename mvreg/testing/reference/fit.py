"""Reference of `mvreg.kernels.fit`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.results import FittedPatches


def fit(points: Array, samples: Array, axes: Array, count: int, ridge: float) -> FittedPatches:
    """Patches of second order through the nearest of points (N, 3) about each sample."""
    apart = np.linalg.norm(samples[:, None] - points[None], axis=2)
    order = np.argsort(apart, axis=1, kind="stable")[:, :count]
    local = (points[order] - samples[:, None]) @ np.swapaxes(axes, 1, 2)
    along = (local[..., :2] ** 2).sum(axis=2)
    reach = np.sqrt(along.max(axis=1))
    unit = np.where(reach > 0, reach, 1.0)
    a, b = local[..., 0] / unit[:, None], local[..., 1] / unit[:, None]
    terms = np.stack([np.ones_like(a), a, b, a * a / 2, a * b, b * b / 2], axis=2)
    system = np.swapaxes(terms, 1, 2) @ terms / terms.shape[1] + ridge * np.eye(6)
    right = np.swapaxes(terms, 1, 2) @ local[..., 2:] / terms.shape[1]
    found = np.linalg.solve(system, right)[..., 0]
    left = local[..., 2] - (terms @ found[..., None])[..., 0]
    return FittedPatches(
        heights=found[:, 0],
        slopes=found[:, 1:3] / unit[:, None],
        bends=found[:, 3:] / unit[:, None] ** 2,
        reach=reach,
        lopsided=np.hypot(a.mean(axis=1), b.mean(axis=1)),
        radius=np.take_along_axis(apart, order, axis=1).max(axis=1),
        variance=(left**2).sum(axis=1) / max(order.shape[1] - 6, 1),
        **cells(points, samples, order, along),
    )


def cells(points: Array, samples: Array, order: Indices, along: Array) -> dict[str, Array]:
    """Count, mean and covariance of the points that are nearer to a sample than to any other.

    Neighbours `order` (S, count) of each sample are `along` its axes so far away (squared).
    """
    apart = np.full((len(samples), len(points)), np.inf)
    np.put_along_axis(apart, order, along, axis=1)
    owner = np.where(np.isfinite(apart.min(axis=0)), apart.argmin(axis=0), -1)
    counts, means = np.zeros(len(samples)), samples.copy()
    seconds = np.zeros((len(samples), 3, 3))
    for k in range(len(samples)):
        mine = points[owner == k]
        if len(mine):
            counts[k], means[k] = len(mine), mine.mean(axis=0)
            seconds[k] = (mine - means[k]).T @ (mine - means[k]) / len(mine)
    return {"counts": counts, "means": means, "seconds": seconds}
