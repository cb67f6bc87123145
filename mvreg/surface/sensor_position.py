"""Estimate from a scan's points alone where its sensor stood, if its rays met in one point.

A camera or a scanner on a tripod samples the directions about it evenly, so that its points are the
denser the nearer they are and the more the surface faces it: density times ``r^2 / |n . u|`` is
constant, with the distance r and the direction u to the right position. The logarithm of that is
fitted by iterated least squares, from many positions in and around the scan.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.geometry.median import median
from mvreg.geometry.nearest import build_tree, neighbours_of
from mvreg.geometry.sphere import sphere_directions
from mvreg.surface.sensor_direction import HIDING_POINTS, NEIGHBOURS, reach_of_neighbours
from mvreg.types import Array, Scan

#: The cells of the picture in which points hide each other (angular spacings of the points), and
#: how much farther a point is than another of its cell that hides it (cells).
CELL, DEPTH = 2.5, 5.0
#: Points asked for their density.
MOST_POINTS = 1500
#: Fewer points say nothing.
FEWEST = 100
#: Cosines of the incidence are taken for this at least.
LEAST_COSINE = 0.05
#: Positions tried: a grid of so many along each axis of the scan, and directions on shells, in
#: lengths of the scan, about its middle; by every n-th point first.
GRID, MARGIN, DIRECTIONS, SHELLS, ROUGH = 6, 0.3, 100, (0.7, 1.2, 2.5), 300
#: So many of them, so far from each other (lengths of the scan), are refined, in so many steps.
STARTS, APART, STEPS = 4, 0.15, 25
#: The plane that holds most points is that of one of so many of them, within so much (lengths).
PLANES, FLAT = 200, 0.005


@dataclass(frozen=True, eq=False)
class Sampled:
    """Points (P, 3) of a scan, their normals (P, 3) of any sign and log densities (P,)."""

    points: Array
    normals: Array
    density: Array


def sampled(scan: Scan) -> Sampled | None:
    """Points of a scan, evenly from its list, with their densities; None for too few."""
    from mvreg.kernels.moments import normals as plane_normals

    count = min(NEIGHBOURS, len(scan.points) - 1)
    if count < NEIGHBOURS:
        return None
    step = max(1, len(scan.points) // MOST_POINTS)
    points = scan.points[step // 2 :: step]
    reach, inner = reach_of_neighbours(scan.points, scan.tree, points, count)
    inner &= reach > 0
    if inner.sum() < FEWEST:
        return None
    chosen = points[inner]
    return Sampled(chosen, plane_normals(scan.tree, chosen, 20), -2 * np.log(reach[inner]))


def spread(residuals: Array) -> Array:
    """Median absolute deviation along the last axis."""
    return median(np.abs(residuals - median(residuals)[..., None]))


def residuals(positions: Array, own: Sampled) -> Array:
    """What densities are more than positions (..., 3) explain, in logarithms (..., P)."""
    away = positions[..., None, :] - own.points
    squared = np.maximum((away**2).sum(axis=-1), np.finfo(float).tiny)
    cosines = np.abs((away * own.normals).sum(axis=-1)) / np.sqrt(squared)
    found: Array = own.density - np.log(np.maximum(cosines, LEAST_COSINE)) + np.log(squared)
    return found


def positions(own: Sampled) -> list[tuple[Array, float]]:
    """The position (3,) that explains the densities best, and the spread that it leaves.

    And its image in the plane that holds most points, refined, with the same: the densities of one
    plane, as of the ground, are the same from both of its sides.
    """
    starts, length = _starts(own)
    found, left = _refined(starts, own, length)
    best = int(left.argmin())
    image = _mirrored(found[best], own, length)
    other, rest = _refined(image[None], own, length)
    return [(found[best], float(left[best])), (other[0], float(rest[0]))]


def _mirrored(position: Array, own: Sampled, length: float) -> Array:
    """The image (3,) of a position in the plane of one of the points that most of them lie on."""
    few = slice(None, None, max(1, len(own.points) // PLANES))
    normals, points = own.normals[few], own.points[few]
    heights = own.points @ normals.T - (points * normals).sum(axis=1)
    best = int((np.abs(heights) <= FLAT * length).sum(axis=0).argmax())
    away = position - points[best]
    image: Array = position - 2 * (away @ normals[best]) * normals[best]
    return image


def _starts(own: Sampled) -> tuple[Array, float]:
    """Positions (S, 3) to begin from, the best of many, and the scan's length."""
    middle = own.points.mean(axis=0)
    axes = np.linalg.eigh((own.points - middle).T @ (own.points - middle))[1]
    axes = axes * np.where(((((own.points - middle) @ axes) ** 3).sum(axis=0)) < 0, -1.0, 1.0)
    along = (own.points - middle) @ axes
    low, high = np.quantile(along, [0.05, 0.95], axis=0)
    length = float(np.linalg.norm(high - low)) or 1.0
    lines = [
        np.linspace(a - MARGIN * (b - a), b + MARGIN * (b - a), GRID)
        for a, b in zip(low, high, strict=True)
    ]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    around = sphere_directions(DIRECTIONS)
    tried = np.concatenate([grid, *(shell * length * around for shell in SHELLS)]) @ axes.T + middle
    few = slice(None, None, max(1, len(own.points) // ROUGH))
    rough = Sampled(own.points[few], own.normals[few], own.density[few])
    order = tried[np.argsort(spread(residuals(tried, rough)), kind="stable")]
    kept: list[Array] = []
    for one in order[: 10 * STARTS]:
        if all(np.linalg.norm(one - other) > APART * length for other in kept):
            kept.append(one)
        if len(kept) == STARTS:
            break
    return np.array(kept), length


def _refined(starts: Array, own: Sampled, length: float) -> tuple[Array, Array]:
    """Positions (S, 3) after damped steps of Gauss-Newton with the weights of Geman and McClure.

    And the spreads (S,) that they leave.
    """
    found = starts.copy()
    best = np.full(len(starts), np.inf)
    here, active = starts.copy(), np.arange(len(starts))
    damping = 1e-2
    for step in range(STEPS + 1):
        rest = residuals(here, own)
        rest -= median(rest)[:, None]
        left = median(np.abs(rest))
        better = left < best[active]
        found[active[better]], best[active[better]] = here[better], left[better]
        if step == STEPS:
            break
        weights = 1 / (1 + (rest / (2 * left + 1e-9)[:, None]) ** 2) ** 2
        jacobian = _jacobian(here, own) * length
        mean = (weights[:, None] @ jacobian) / weights.sum(axis=1)[:, None, None]
        jacobian = jacobian - mean  # the factor is free
        across = jacobian.swapaxes(1, 2)
        normal = across @ (weights[..., None] * jacobian)
        trace = np.trace(normal, axis1=1, axis2=2)
        damped = normal + (damping / 3 * trace)[:, None, None] * np.eye(3)
        move = np.linalg.solve(damped, across @ (weights * rest)[..., None])[..., 0]
        size = np.linalg.norm(move, axis=1)
        move *= np.minimum(1.0, 0.3 / np.maximum(size, 1e-12))[:, None]
        here = here - move * length
        # A last look at where the small steps lead, and no further.
        going = size >= 1e-3
        if not going.all():
            last = here[~going]
            after = spread(residuals(last, own))
            stopped = active[~going]
            better = after < best[stopped]
            found[stopped[better]], best[stopped[better]] = last[better], after[better]
            here, active = here[going], active[going]
            if not len(active):
                break
    return found, best


def _jacobian(positions: Array, own: Sampled) -> Array:
    """Derivatives (S, P, 3) of `residuals` by the positions (S, 3)."""
    away = positions[:, None] - own.points
    squared = np.maximum((away**2).sum(axis=-1, keepdims=True), np.finfo(float).tiny)
    facing = (away * own.normals).sum(axis=-1, keepdims=True)
    steep = np.abs(facing) < LEAST_COSINE * np.sqrt(squared)
    slope = np.where(steep, 0.0, own.normals / np.where(facing == 0, 1.0, facing))
    found: Array = -slope + np.where(steep, 2.0, 3.0) * away / squared
    return found


def hidden_from(points: Array, position: Array) -> float:
    """Share of the points (N, 3) that others hide from a sensor at a position (3,).

    The picture is on the six sides of a cube about the position.
    """
    away = points[:: max(1, -(-len(points) // HIDING_POINTS))] - position
    ranges = np.maximum(np.linalg.norm(away, axis=1), np.finfo(float).tiny)
    rays = away / ranges[:, None]
    cell = CELL * float(np.median(neighbours_of(build_tree(rays), rays, 2)[0][:, 1])) or 1e-9
    axis = np.abs(rays).argmax(axis=1)
    rows = np.arange(len(rays))
    front = rays[rows, axis]
    across = np.stack([rays[rows, (axis + k) % 3] / np.abs(front) for k in (1, 2)], axis=1)
    cells = np.column_stack([2 * axis + (front > 0), np.floor(across / cell)]).astype(np.int64)
    _, pixel = np.unique(cells, axis=0, return_inverse=True)
    pixel = pixel.ravel()
    nearest = np.full(int(pixel.max()) + 1, np.inf)
    np.minimum.at(nearest, pixel, ranges)
    return float((ranges - nearest[pixel] > DEPTH * cell * ranges).mean())
