"""Reference of `mvreg.kernels.evidence`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array, Flags, Indices

Span = tuple[Array, Array, Array]


def nearby(
    seen: Array, direction: Array | None, origin: Array | None, reach: float, points: Array,
    most: int,
) -> Span:  # fmt: skip
    """As `Rays.nearby`, of the points seen (N, 3)."""
    height, _, near, own = _nearest(seen, direction, origin, reach, points, most)
    return height, *_span(near, own)


def before_and_on(
    seen: Array, direction: Array | None, origin: Array | None, reach: float, points: Array,
    normals: Array, most: int, tolerance: float,
) -> tuple[int, int]:  # fmt: skip
    """How many points (M, 3) float before what was seen, and how many lie on it.

    None floats whose own plane holds what the highest of its rays met.
    """
    height, order, near, own = _nearest(seen, direction, origin, reach, points, most)
    low, high = _span(near, own)
    top = order[np.arange(len(points)), np.where(near, own, -np.inf).argmax(axis=1)]
    off = np.abs(((seen[top] - points) * normals).sum(axis=1))
    before = (height > high + tolerance) & (off > tolerance)
    on = ~before & (height >= low - tolerance) & np.isfinite(low)
    return int(before.sum()), int(on.sum())


def _nearest(
    seen: Array, direction: Array | None, origin: Array | None, reach: float, points: Array,
    most: int,
) -> tuple[Array, Indices, Flags, Array]:  # fmt: skip
    """Heights of points (M, 3); their nearest rays (M, K), which are near, and their heights."""
    across, own = _rays(seen, seen, direction, origin)
    asked, height = _rays(seen, points, direction, origin)
    apart = np.linalg.norm(asked[:, None] - across[None], axis=2)
    order = np.argsort(apart, axis=1, kind="stable")[:, :most]
    return height, order, np.take_along_axis(apart, order, axis=1) < reach, own[order]


def _span(near: Flags, heights: Array) -> tuple[Array, Array]:
    """The lowest and the highest of the heights (M, K) that are near; NaN where none is."""
    low = np.where(near, heights, np.inf).min(axis=1, initial=np.inf)
    high = np.where(near, heights, -np.inf).max(axis=1, initial=-np.inf)
    missed = ~near.any(axis=1)
    low[missed] = high[missed] = np.nan
    return low, high


def _rays(
    seen: Array, points: Array, direction: Array | None, origin: Array | None
) -> tuple[Array, Array]:
    """Where the rays of points are across each other, and how far towards the sensor."""
    if direction is not None:
        height = points @ direction
        return points - height[:, None] * direction, height
    assert origin is not None
    length = np.linalg.norm(points - origin, axis=1)
    unit = (points - origin) / np.maximum(length, np.finfo(float).tiny)[:, None]
    return np.linalg.norm(seen - origin, axis=1).mean() * unit, -length


def partners(
    target: Array, planes: Array, points: Array, normals: Array, transform: Array, reach: float
) -> tuple[Indices, Array, Array, Array]:
    """Which points (P, 3) have a neighbour within reach; gaps, cosines, and planes there."""
    moved = se3.apply(transform, points)
    if not len(target) or not len(points):
        return np.empty(0, dtype=np.intp), np.empty((0, 3)), np.empty(0), np.empty((0, 3))
    apart = np.linalg.norm(moved[:, None] - target[None], axis=2)
    which = np.flatnonzero(apart.min(axis=1) < reach)
    other = apart.argmin(axis=1)[which]
    cosines = ((normals[which] @ transform[:3, :3].T) * planes[other]).sum(axis=1)
    return which, moved[which] - target[other], cosines, planes[other]


def directed_evidence(
    target: Array, planes: Array, points: Array, normals: Array, centre: Array, transform: Array,
    reach: float, least_cosine: float, oriented: bool,
) -> tuple[NDArray[np.bool_], int, Array]:  # fmt: skip
    """The surface part of `directed_evidence`: contacts, near points, sums."""
    which, gaps, cosines, there = partners(target, planes, points, normals, transform, reach)
    if not oriented:
        there = np.where(cosines[:, None] < 0, -there, there)
        cosines = np.abs(cosines)
    agree = cosines > least_cosine
    met = np.zeros(len(points), dtype=bool)
    met[which[agree]] = True
    heights = (gaps[agree] * there[agree]).sum(axis=1)
    own, other = normals[met], there[agree] @ transform[:3, :3]
    p = points[met] - centre
    first, second = (np.hstack([np.cross(p, n), n]) for n in (own, other))
    sums = [(heights**2).sum()], p.sum(axis=0), [(p**2).sum()], first.T @ second, second.T @ second
    both = np.concatenate([*(np.ravel(one) for one in sums), heights @ second])
    return met, len(which), both


def contact_heights(
    target: Array, planes: Array, points: Array, normals: Array, transform: Array, reach: float,
    least_cosine: float,
) -> tuple[Indices, Array]:  # fmt: skip
    """As `mvreg.kernels.overlap.contact_heights`."""
    which, gaps, cosines, there = partners(target, planes, points, normals, transform, reach)
    agree = np.abs(cosines) > least_cosine
    return which[agree], np.abs((gaps[agree] * there[agree]).sum(axis=1))


def box(points: Array, transform: Array) -> tuple[Array, Array]:
    """As `mvreg.kernels.overlap.box`."""
    moved = se3.apply(transform, points)
    return moved.min(axis=0, initial=np.inf), moved.max(axis=0, initial=-np.inf)


def hidden(points: Array, directions: Array, landmark: Array, cell: float, depth: float) -> Array:
    """As `mvreg.kernels.hidden.hidden`."""
    return np.array([_hidden(points, one, landmark, cell, depth) for one in directions])


def _hidden(points: Array, direction: Array, landmark: Array, cell: float, depth: float) -> float:
    x = np.cross(direction, landmark)
    if not np.linalg.norm(x) > 1e-6 * np.linalg.norm(landmark):
        x = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(direction, x)], axis=1)
    pixels, which = np.unique(np.floor(points @ axes / cell), axis=0, return_inverse=True)
    heights, tops = points @ direction, np.full(len(pixels), -np.inf)
    np.maximum.at(tops, which.ravel(), heights)
    return float((tops[which.ravel()] - heights > depth).mean())
