"""Points on the triangles of a mesh whose vertices alone would not show its surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mvreg.geometry.arrays import Array

#: At least so many points show a surface, spread evenly.
ENOUGH = 20_000
#: A triangle is coarse where its longest edge is so many times as long as evenly spread points
#: would be apart, and a mesh where so much of its area is in coarse triangles.
COARSE, SHARE = 5.0, 0.2
#: What is spread most evenly over a triangle, point by point (Roberts 2018, "The unreasonable
#: effectiveness of quasirandom sequences"): the golden ratio in two dimensions.
_PLASTIC = 1.32471795724474602596

Values = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class OnTriangles:
    """Points (N, 3) on the triangles of a mesh.

    `corners` (N, 3) are the vertices of each one's triangle, `weights` (N, 3) its barycentric
    coordinates, `normals` (N, 3) the triangles' own, unit.
    """

    points: Array
    corners: Values
    weights: Array
    normals: Array

    def interpolated(self, values: Values) -> Values:
        """Values (V,) of the vertices at the points (N,), of the same type."""
        mean = np.sum(values[self.corners] * self.weights, axis=1)
        found: Values = mean.round() if values.dtype.kind in "iu" else mean
        return found.astype(values.dtype)


def on_coarse_triangles(points: Array, triangles: Values) -> OnTriangles | None:
    """Points spread evenly over a coarse mesh; None where its vertices show the surface.

    Scale-free and deterministic. Were as many points as the mesh has vertices, `ENOUGH` at least,
    spread evenly over its area, they would be some distance apart. A mesh is coarse where many
    triangles are far longer than that, as of those that were thinned out where they are flat; it
    gets so many points: of the same surface, however finely it is meshed, about the same.

    Triangles with a vertex that is missing or not finite, and those without an area, do not count.
    Where more than one vertex in 20 is in no triangle, the points are what is meant.

    Parameters
    ----------
    points : (V, 3) array
        The vertices; not finite where one is missing.
    triangles : (M, 3) integer array
        Indices into `points`.
    """
    if not len(triangles):
        return None
    used = _usable(points, triangles)
    if len(np.unique(used)) < 0.95 * len(points):
        return None
    first, second, third = (points[used[:, i]] for i in range(3))
    with np.errstate(over="ignore", invalid="ignore"):
        normals = np.cross(second - first, third - first)
        doubled = np.linalg.norm(normals, axis=1)
        edges = [second - first, third - second, first - third]
        longest = np.max([np.linalg.norm(edge, axis=1) for edge in edges], axis=0, initial=0)
        area = doubled.sum() / 2
    count = max(ENOUGH, len(points))
    if not (np.isfinite(area) and area > 0):
        return None
    coarse = longest > COARSE * np.sqrt(area / count)
    if doubled[coarse].sum() / 2 < SHARE * area:
        return None
    chosen, weights = _spread(doubled, count)
    corners = used[chosen]
    spread = np.einsum("nk,nkd->nd", weights, points[corners])
    return OnTriangles(spread, corners, weights, normals[chosen] / doubled[chosen, None])


def _usable(points: Array, triangles: Values) -> Values:
    """The triangles whose corners are all there."""
    found = np.asarray(triangles).reshape(-1, 3).astype(np.int64)
    there = np.asarray(np.all((found >= 0) & (found < len(points)), axis=1))
    found = found[there]
    finite = np.asarray(np.isfinite(points).all(axis=1))
    return np.asarray(found[finite[found].all(axis=1)])


def _spread(areas: Array, count: int) -> tuple[Values, Array]:
    """Which triangle each point is on, and where: barycentric weights (count, 3)."""
    ends = np.cumsum(areas)
    at = (np.arange(count) + 0.5) / count * ends[-1]
    chosen = np.minimum(np.searchsorted(ends, at, side="right"), len(areas) - 1)
    order = np.arange(count)
    u, v = (0.5 + order / _PLASTIC) % 1, (0.5 + order / _PLASTIC**2) % 1
    outside = u + v > 1
    u, v = np.where(outside, 1 - u, u), np.where(outside, 1 - v, v)
    return chosen, np.stack([1 - u - v, u, v], axis=1)
