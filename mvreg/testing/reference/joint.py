"""Reference of the joint refinement's kernels: patches, contacts, residuals, normal equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array, Indices


@dataclass(frozen=True, eq=False)
class Patches:
    """The patches of a surface, see `mvreg.stages.adjust.joint.surface.Surface`."""

    points: Array
    axes: Array
    slopes: Array
    bends: Array
    normals: Array
    reach: Array
    whole: NDArray[np.bool_]
    usable: NDArray[np.bool_]
    means: Array
    seconds: Array


def gaps(
    surface: Patches, points: Array, patches: Indices, flat: bool, spread: Array | None = None
) -> tuple[Array, Array, Array]:
    """How far points are from patches, across the surface and along it.

    Of means of points with a covariance `spread` (M, 3, 3), how far these are in the mean.
    """
    local = np.einsum("mij,mj->mi", surface.axes[patches], points - surface.points[patches])
    across, height = local[:, :2], local[:, 2]
    slopes = surface.slopes[patches]
    below = (slopes * across).sum(axis=1)
    if not flat:
        bends = surface.bends[patches]
        a, b = across.T
        bent = np.stack([bends[:, 0] * a + bends[:, 1] * b, bends[:, 1] * a + bends[:, 2] * b])
        below = below + (bent.T * across).sum(axis=1) / 2
        slopes = slopes + bent.T
        if spread is not None:
            along = surface.axes[patches][:, :2]
            (aa, ab), (_, bb) = np.einsum("mai,mij,mbj->abm", along, spread, along)
            below = below + (bends * np.stack([aa, 2 * ab, bb], axis=1)).sum(axis=1) / 2
    upright = np.column_stack([-slopes, np.ones(len(slopes))])
    normals = np.einsum("mi,mij->mj", upright, surface.axes[patches])
    steep = np.linalg.norm(normals, axis=1)
    return (
        (height - below) / steep, normals / steep[:, None], np.sqrt((across**2).sum(axis=1)),
    )  # fmt: skip


def contacts(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    reach: float,
    stride: int,
    flat: bool,
    least_cosine: float,
    oriented: NDArray[np.bool_],
) -> tuple[Indices, Indices, Indices]:
    """Where the samples of surfaces lie on the patches of others."""
    found = [
        touch(surfaces[i], surfaces[j], se3.invert(motions[j]) @ motions[i],
              reach, stride, flat, least_cosine, bool(oriented[i] and oriented[j]))
        for i, j in ways
    ]  # fmt: skip
    none = np.empty(0, dtype=np.intp)
    ends = np.cumsum([0, *(len(samples) for samples, _ in found)])
    return (
        ends,
        np.concatenate([none, *(samples for samples, _ in found)]),
        np.concatenate([none, *(patches for _, patches in found)]),
    )


def touch(
    source: Patches,
    target: Patches,
    transform: Array,
    reach: float,
    stride: int,
    flat: bool,
    least_cosine: float,
    oriented: bool,
) -> tuple[Indices, Indices]:
    """Where the samples of a surface lie on the patches of another."""
    samples = np.arange(0, len(source.points), stride)
    if not len(target.points):
        return samples[:0], samples[:0]
    points = se3.apply(transform, source.means[samples])
    apart = np.linalg.norm(points[:, None] - target.points[None], axis=2)
    patches = apart.argmin(axis=1)
    _, normals, aside = gaps(target, points, patches, flat)
    cosines = ((source.normals[samples] @ transform[:3, :3].T) * normals).sum(axis=1)
    agree = (cosines if oriented else np.abs(cosines)) > least_cosine
    agree &= source.usable[samples] & target.whole[patches] & (apart.min(axis=1) < reach)
    if not flat:
        agree &= aside <= target.reach[patches]
    return samples[agree], patches[agree]


def rows(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    ends: Indices,
    samples: Indices,
    patches: Indices,
    centre: Array,
    radius: float,
    flat: bool,
    residuals: Array,
    jacobian: Array,
    points: Array,
    aside: Array,
) -> None:
    """How far samples' cells are from patches, and how that changes with the source's motion."""
    for (i, j), part in zip(ways, parts_of(ends), strict=True):
        into = se3.invert(motions[j]) @ motions[i]
        there = se3.apply(into, surfaces[i].means[samples[part]])
        spread = into[:3, :3] @ surfaces[i].seconds[samples[part]] @ into[:3, :3].T
        heights, normals, along = gaps(surfaces[j], there, patches[part], flat, spread)
        aside[part] = (along / surfaces[j].reach[patches[part]]) ** 2
        residuals[part] = heights / radius
        points[part] = (se3.apply(motions[j], there) - centre) / radius
        jacobian[part, 3:] = normals @ motions[j][:3, :3].T
        jacobian[part, :3] = np.cross(points[part], jacobian[part, 3:])


def parts_of(ends: Indices) -> list[slice]:
    """Where the contacts of each way are."""
    return [slice(*pair) for pair in pairwise(ends)]


def normal_equations(
    jacobian: Array, residuals: Array, weights: Array, ends: Indices, width: float
) -> tuple[Array, Array]:
    """The weighted sums ``J^T W J`` and ``J^T W r`` over each way's rows."""
    square = (residuals / width) ** 2
    weights = weights * np.where(square < 1, (1 - square) ** 2, 0.0)
    weighted = jacobian * weights[:, None]
    normals = [jacobian[part].T @ weighted[part] for part in parts_of(ends)]
    gradients = [weighted[part].T @ residuals[part] for part in parts_of(ends)]
    return np.array(normals).reshape(-1, 6, 6), np.array(gradients).reshape(-1, 6)


def group_sums(
    jacobian: Array, residuals: Array, weights: Array, groups: Indices, ends: Indices, width: float
) -> tuple[Indices, Indices, Array, Array]:
    """The sums ``J^T W J`` and ``J^T W r`` of each way's residuals by group."""
    counts, names = [0], [np.empty(0, dtype=np.intp)]
    normals, gradients = [np.empty((0, 6, 6))], [np.empty((0, 6))]
    for part in parts_of(ends):
        found = np.unique(groups[part])
        counts.append(len(found))
        names.append(found)
        for group in found:
            mine = groups[part] == group
            values = jacobian[part][mine], residuals[part][mine], weights[part][mine]
            sums = normal_equations(*values, np.array([0, mine.sum()]), width)
            normals.append(sums[0])
            gradients.append(sums[1])
    sums = np.concatenate(normals), np.concatenate(gradients)
    return np.cumsum(counts), np.concatenate(names), *sums


def farthest(points: Array, before: Array, after: Array) -> float:
    """How far a motion goes from another for any of points (N, 3), at most."""
    moves = se3.apply(after, points) - se3.apply(before, points)
    return float(np.linalg.norm(moves, axis=1).max(initial=0.0))
