"""Reference of `mvreg.kernels.joint`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvreg import se3
from mvreg.types import Array, Indices


@dataclass(frozen=True, eq=False)
class Patches:
    """The patches of a surface, see `mvreg.stages.joint_surface.Surface`."""

    points: Array
    axes: Array
    slopes: Array
    bends: Array
    normals: Array
    reach: Array
    whole: NDArray[np.bool_]


def gaps(
    surface: Patches, points: Array, patches: Indices, flat: bool
) -> tuple[Array, Array, Array]:
    """How far points are from patches, across the surface and along it."""
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
    steep = np.sqrt(1 + (slopes**2).sum(axis=1))
    upright = np.column_stack([-slopes, np.ones(len(slopes))]) / steep[:, None]
    normals = np.einsum("mi,mij->mj", upright, surface.axes[patches])
    return (height - below) / steep, normals, np.sqrt((across**2).sum(axis=1))


def contacts(
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
    points = se3.apply(transform, source.points[samples])
    apart = np.linalg.norm(points[:, None] - target.points[None], axis=2)
    patches = apart.argmin(axis=1)
    _, normals, aside = gaps(target, points, patches, flat)
    cosines = ((source.normals[samples] @ transform[:3, :3].T) * normals).sum(axis=1)
    agree = (cosines if oriented else np.abs(cosines)) > least_cosine
    agree &= source.whole[samples] & target.whole[patches] & (apart.min(axis=1) < reach)
    if not flat:
        agree &= aside <= target.reach[patches]
    return samples[agree], patches[agree]


def rows(
    source: Patches,
    target: Patches,
    source_motion: Array,
    target_motion: Array,
    samples: Indices,
    patches: Indices,
    centre: Array,
    radius: float,
    flat: bool,
) -> tuple[Array, Array, Array]:
    """How far samples are from patches, and how that changes with the source's motion."""
    into = se3.invert(target_motion) @ source_motion
    points = se3.apply(into, source.points[samples])
    heights, normals, _ = gaps(target, points, patches, flat)
    normals = normals @ target_motion[:3, :3].T
    points = (se3.apply(target_motion, points) - centre) / radius
    jacobian = np.concatenate([np.cross(points, normals), normals], axis=1)
    return heights / radius, jacobian, points


def normal_equations(
    jacobian: Array, residuals: Array, weights: Array, width: float, cut: float
) -> tuple[Array, Array]:
    """The weighted sums ``J^T W J`` and ``J^T W r``."""
    square = (residuals / width) ** 2
    weights = weights * np.where(square < cut**2, (1 + square) ** -2.0, 0.0)
    weighted = jacobian * weights[:, None]
    return jacobian.T @ weighted, weighted.T @ residuals


def cell_sums(
    jacobian: Array,
    residuals: Array,
    weights: Array,
    points: Array,
    width: float,
    cut: float,
    low: Array,
    edge: float,
    across: Indices,
) -> tuple[Indices, Array]:
    """The gradients ``J^T W r`` of the residuals in every cell of a grid."""
    places = np.floor((points - low) / edge).astype(np.int64)
    keys = (places[:, 0] * across[1] + places[:, 1]) * across[2] + places[:, 2]
    cells = np.unique(keys)
    sums = [
        normal_equations(jacobian[k], residuals[k], weights[k], width, cut)[1]
        for k in (keys == cell for cell in cells)
    ]
    return cells, np.array(sums).reshape(-1, 6)


def farthest(points: Array, before: Array, after: Array) -> float:
    """How far a motion goes from another for any of points (N, 3), at most."""
    moves = se3.apply(after, points) - se3.apply(before, points)
    return float(np.linalg.norm(moves, axis=1).max(initial=0.0))


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
