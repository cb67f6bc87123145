"""Solid shapes from signed distances: a few primitives, smooth unions, and a mesh of the result.

Distances are negative inside, and exact enough near the surface only. The primitives and the
smooth union are Inigo Quilez's (https://iquilezles.org/articles/distfunctions/), the mesh is
Gibson's surface nets ("Constrained elastic surface nets", MICCAI 1998).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvreg.types import Indices

Array = NDArray[np.floating]
Distance = Callable[[Array], Array]

CHUNK = 8192


@dataclass(frozen=True, eq=False)
class Part:
    """One primitive: `distance` maps (N, 3) points to (N,) signed distances.

    `centre` and `radius` bound its surface. `blend` is the width over which it melts into the parts
    before it; with `carve` it is taken away from them.
    """

    distance: Distance
    centre: Array
    radius: float
    blend: float = 0.0
    carve: bool = False


def evaluate(
    parts: Sequence[Part], points: Array, active: Sequence[Indices]
) -> tuple[Array, list[Array]]:
    """Signed distances of the parts together, and of each by itself.

    Parameters
    ----------
    parts : sequence of Part
        Joined in this order.
    points : (N, 3) array
    active : sequence of index arrays
        For each part the points at which it can matter; it is evaluated nowhere else.

    Returns
    -------
    together : (N,) array
        Infinite where no part can matter.
    apart : list of arrays
        For each part its distances, at its active points.
    """
    together, apart = np.full(len(points), np.inf), []
    for part, where in zip(parts, active, strict=True):
        new = _in_chunks(part.distance, points[where])
        apart.append(new)
        if part.carve:
            together[where] = -smooth_min(-together[where], new, part.blend)
        else:
            together[where] = smooth_min(together[where], new, part.blend)
    return together, apart


def _in_chunks(distance: Distance, points: Array) -> Array:
    """The distances of many points; temporaries that fit the cache save more than half the time."""
    starts = range(0, max(len(points), 1), CHUNK)
    return np.concatenate([distance(points[start : start + CHUNK]) for start in starts])


def smooth_min(first: Array, second: Array, blend: float) -> Array:
    """The smaller of the two; where they differ by less than `blend`, a little less than that."""
    smallest = np.minimum(first, second)
    if blend <= 0:
        return smallest
    overlap = np.maximum(blend - np.abs(first - second), 0)
    return smallest - overlap * overlap / (4 * blend)


def ellipsoid(centre: Sequence[float], radii: Sequence[float], frame: Array | None = None,
              relief: Distance | None = None, blend: float = 0.0,
              carve: bool = False) -> Part:  # fmt: skip
    """An ellipsoid; the columns of `frame` (3, 3) are its axes, `relief` is added outwards."""
    origin, axes = np.array(centre, dtype=float), np.array(radii, dtype=float)
    turn = np.eye(3) if frame is None else frame

    def distance(points: Array) -> Array:
        local = (points - origin) @ turn
        scaled = local / axes
        first = np.sqrt(np.einsum("ij,ij->i", scaled, scaled))
        scaled /= axes
        second = np.sqrt(np.einsum("ij,ij->i", scaled, scaled))
        plain: Array = first * (first - 1) / np.maximum(second, 1e-9)
        return plain if relief is None else plain - relief(points)

    return Part(distance, origin, float(axes.max()) + 1, blend, carve)


def block(centre: Sequence[float], half: Sequence[float], rounding: float,
          frame: Array | None = None, relief: Distance | None = None, blend: float = 0.0,
          carve: bool = False) -> Part:  # fmt: skip
    """A box of half sizes `half` with rounded edges."""
    origin, size = np.array(centre, dtype=float), np.array(half, dtype=float)
    turn = np.eye(3) if frame is None else frame

    def distance(points: Array) -> Array:
        beyond = np.abs((points - origin) @ turn) - (size - rounding)
        outside = np.maximum(beyond, 0)
        plain: Array = np.sqrt(np.einsum("ij,ij->i", outside, outside))
        deepest = np.maximum(np.maximum(beyond[:, 0], beyond[:, 1]), beyond[:, 2])
        plain += np.minimum(deepest, 0) - rounding
        return plain if relief is None else plain - relief(points)

    return Part(distance, origin, float(np.linalg.norm(size)) + 1, blend, carve)


def torus(centre: Sequence[float], major: Sequence[float], minor: Sequence[float],
          frame: Array | None = None, relief: Distance | None = None,
          blend: float = 0.0) -> Part:  # fmt: skip
    """A ring around its z axis: half axes `major` (2), and a section of radius and half height."""
    origin, ring = np.array(centre, dtype=float), np.array(major, dtype=float)
    turn = np.eye(3) if frame is None else frame
    flat = minor[1] / minor[0]

    def distance(points: Array) -> Array:
        local = (points - origin) @ turn
        scaled = local[:, :2] / ring
        first = np.sqrt(np.einsum("ij,ij->i", scaled, scaled))
        scaled /= ring
        second = np.sqrt(np.einsum("ij,ij->i", scaled, scaled))
        across = first * (first - 1) / np.maximum(second, 1e-9)
        section = np.hypot(across, local[:, 2] / flat) - minor[0]
        plain: Array = section * min(1.0, flat)
        return plain if relief is None else plain - relief(points)

    return Part(distance, origin, float(ring.max() + max(minor)) + 1, blend)


def limb(path: Sequence[Sequence[float]], radii: Sequence[float], relief: Distance | None = None,
         blend: float = 0.0, steps: int = 1, carve: bool = False) -> Part:  # fmt: skip
    """A round rod through the points of `path`, with a radius at each; `steps` > 1 rounds bends."""
    knots = np.column_stack([np.array(path, dtype=float), np.array(radii, dtype=float)])
    knots = _catmull_rom(knots, steps)
    centre = (knots[:, :3].min(axis=0) + knots[:, :3].max(axis=0)) / 2
    reach = np.linalg.norm(knots[:, :3] - centre, axis=1) + knots[:, 3]
    starts = knots[:-1, :3] - centre
    along, widths = np.diff(knots[:, :3], axis=0), knots[:, 3]

    def distance(points: Array) -> Array:
        local = points - centre
        squared = np.einsum("ij,ij->i", local, local)
        plain = np.full(len(points), np.inf)
        for start, axis, dots, lasts, width, end_width in zip(
            starts, along, along @ local.T, starts @ local.T, widths[:-1], widths[1:], strict=True
        ):
            dots -= start @ axis
            share = np.clip(dots / (axis @ axis), 0, 1)
            square = (
                squared - 2 * lasts + start @ start + share * (share * (axis @ axis) - 2 * dots)
            )
            length = np.sqrt(np.maximum(square, 0))
            np.minimum(plain, length - (width + share * (end_width - width)), out=plain)
        return plain if relief is None else plain - relief(points)

    return Part(distance, centre, float(reach.max()) + 1, blend, carve)


def _catmull_rom(knots: Array, steps: int) -> Array:
    """A smooth curve through knots (N, D), `steps` points for each piece."""
    if steps <= 1 or len(knots) < 3:
        return knots
    padded = np.vstack([2 * knots[0] - knots[1], knots, 2 * knots[-1] - knots[-2]])
    a, b, c, d = padded[:-3], padded[1:-2], padded[2:-1], padded[3:]
    t = (np.arange(steps) / steps)[None, :, None]
    a, b, c, d = (x[:, None, :] for x in (a, b, c, d))
    curve = b + (c - a) * t / 2 + (a - 2.5 * b + 2 * c - d / 2) * t**2
    curve = curve + (1.5 * (b - c) + (d - a) / 2) * t**3
    return np.vstack([curve.reshape(-1, knots.shape[1]), knots[-1:]])
