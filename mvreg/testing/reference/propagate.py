"""Reference of `mvreg.kernels.propagate`."""

from __future__ import annotations

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array, Features, Indices


def angles_to(normals: Array, index: int, oriented: bool) -> Array:
    """Angles (K, L) in radians between all normals (K, L, 3) and those of one keypoint."""
    cosine = np.einsum("klc,lc->kl", normals, normals[index])
    if not oriented:
        cosine = np.abs(cosine)
    angles: Array = np.arccos(np.clip(cosine, -1, 1))
    return angles


def band_pairs(wanted: Array, have: Array, tolerance: float) -> tuple[Indices, Indices]:
    """All index pairs (i, j) with ``abs(wanted[i] - have[j]) <= tolerance``, grouped by i.

    Sorting makes it O((m + n) log n + pairs), the cost that the paper claims.
    """
    order = np.argsort(have, kind="stable")
    ascending = have[order]
    first = np.searchsorted(ascending, wanted - tolerance, side="left")
    last = np.searchsorted(ascending, wanted + tolerance, side="right")
    count = last - first
    i = np.repeat(np.arange(len(wanted)), count)
    start = np.cumsum(count) - count
    j = order[np.arange(count.sum()) - np.repeat(start - first, count)]
    return i, j


def best_of_each(group: Indices, cost: Array) -> Indices:
    """Positions of the cheapest member of each group."""
    order = np.lexsort((cost, group))
    grouped = group[order]
    fresh = np.ones(len(grouped), dtype=bool)
    fresh[1:] = grouped[1:] != grouped[:-1]
    return order[fresh]


def spread(
    own: Features,
    other: Features,
    seed: tuple[int, int],
    distance_tolerance: float,
    angle_tolerance: float,
    descriptor_tolerance: float,
    step: int = 1,
) -> Indices:
    """Spread the seed (i, j) over both shapes: matches (M, 2), the seed first."""
    i, j = seed
    oriented = own.oriented and other.oriented
    distance = np.linalg.norm(own.keypoints - own.keypoints[i], axis=1)
    wanted = np.linalg.norm(other.keypoints - other.keypoints[j], axis=1)
    m, n = band_pairs(wanted, distance, distance_tolerance)
    alpha, theta = angles_to(own.normals, i, oriented), angles_to(other.normals, j, oriented)
    close = (np.abs(alpha[n] - theta[m]) < angle_tolerance).all(axis=1)
    m, n = m[close], n[close]
    best = best_of_each(m, np.abs(alpha[n] - theta[m]).mean(axis=1))
    m, n = m[best], n[best]
    apart = np.linalg.norm(own.descriptors[n] - other.descriptors[m], axis=1)
    keep = (apart < descriptor_tolerance) & (m != j) & (m % step == 0)
    return np.concatenate([[[i, j]], np.stack([n[keep], m[keep]], axis=1)])


def nearest_rows(queries: Array, rows: Array) -> tuple[Array, Indices]:
    """The nearest of rows (N, D) to each of queries (M, D)."""
    far = np.linalg.norm(queries[:, None] - rows[None], axis=2)
    return far.min(axis=1), far.argmin(axis=1)


def consensus(
    source: Array, target: Array, draws: Indices, tolerance: float
) -> tuple[Array, Indices] | None:
    """The motion that most of the matched points (M, 3) agree with, of samples (S, 3) of three."""
    # A sample must be a triangle of some size that keeps its shape, or it fixes no motion.
    here, there = source[draws], target[draws]
    sides = [np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2) for x in (here, there)]
    sound = (np.abs(sides[0] - sides[1]).max(axis=1) < 2 * tolerance) & (
        np.linalg.norm(np.cross(here[:, 1] - here[:, 0], here[:, 2] - here[:, 0]), axis=1)
        > tolerance**2
    )
    if not sound.any():
        return None
    motions = se3.fit(here[sound], there[sound])
    moved = source @ np.swapaxes(motions[:, :3, :3], 1, 2) + motions[:, None, :3, 3]
    agree = ((moved - target) ** 2).sum(axis=2) < tolerance**2
    votes = agree.sum(axis=1)
    best = int(votes.argmax())
    if votes[best] <= 3:
        return None
    agreeing = np.flatnonzero(agree[best])
    return se3.fit(source[agreeing], target[agreeing]), agreeing
