"""What scenes are built of: convex polyhedra, cylinders and ellipsoids, which rays meet exactly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array

#: Stands in for a slope of 0, so that a ray along a face divides by something.
FLAT = 1e-300


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex body; subclasses say where rays enter it.

    Parameters
    ----------
    pose : (4, 4) array
        ``T_world_solid``.
    """

    pose: Array

    @property
    def reach(self) -> float:
        """No point of the solid is farther from the origin of its frame (length)."""
        raise NotImplementedError

    def moved(self, transform: Array) -> Self:
        """The same solid elsewhere: ``T_world_solid`` becomes ``transform @ T_world_solid``."""
        return replace(self, pose=transform @ self.pose)

    def clearance(self, points: Array) -> Array:
        """How far from the solid points (N, 3) are at least (N,): 0 on it, negative inside."""
        return self._clearance(se3.apply(se3.invert(self.pose), points))

    def meet(self, start: Array, rays: Array) -> tuple[Array, Array]:
        """Where rays from outside enter the solid.

        Parameters
        ----------
        start : (3,) array
        rays : (N, 3) array
            Unit vectors.

        Returns
        -------
        ranges, cosines : (N,) arrays
            From the start to the surface, infinite for rays that miss; the cosines of the angles
            of incidence.
        """
        rotation, origin = self.pose[:3, :3], self.pose[:3, 3]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            enter, leave, cosines = self._cross((start - origin) @ rotation, rays @ rotation)
        return np.where((enter > 0) & (enter < leave), enter, np.inf), cosines

    def _clearance(self, points: Array) -> Array:
        raise NotImplementedError

    def _cross(self, start: Array, rays: Array) -> tuple[Array, Array, Array]:
        """Ranges at which rays enter and leave, and cosines, all (N,), in the solid's frame."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Polyhedron(Solid):
    """A convex polyhedron: the points with ``normals @ x <= offsets``.

    Parameters
    ----------
    normals : (M, 3) array
        Unit normals of its faces, outwards.
    offsets : (M,) array
        Distances of the faces from the origin of its frame.
    vertices : (V, 3) array
    """

    normals: Array
    offsets: Array
    vertices: Array

    @property
    def reach(self) -> float:
        """Distance of the farthest vertex."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    def _clearance(self, points: Array) -> Array:
        gaps: Array = (points @ self.normals.T - self.offsets).max(axis=1)
        return gaps

    def _cross(self, start: Array, rays: Array) -> tuple[Array, Array, Array]:
        slopes = self.normals @ rays.T  # one row for each face: such rows are fast
        slopes[slopes == 0] = FLAT
        ranges = (self.offsets - self.normals @ start)[:, None] / slopes
        inwards = slopes < 0
        leave: Array = np.where(inwards, np.inf, ranges).min(axis=0)
        ranges[~inwards] = -np.inf
        face, each = ranges.argmax(axis=0), np.arange(len(rays))
        return ranges[face, each], leave, -slopes[face, each]


@dataclass(frozen=True, eq=False)
class Cylinder(Solid):
    """A cylinder about the z axis of its frame, closed at both ends, its centre in the origin."""

    radius: float
    half: float

    @property
    def reach(self) -> float:
        """Distance of its rims."""
        return float(np.hypot(self.radius, self.half))

    def _clearance(self, points: Array) -> Array:
        around = np.hypot(points[:, 0], points[:, 1]) - self.radius
        gaps: Array = np.maximum(around, np.abs(points[:, 2]) - self.half)
        return gaps

    def _cross(self, start: Array, rays: Array) -> tuple[Array, Array, Array]:
        side_in, side_out = _quadric(start[:2], rays[:, :2], self.radius)
        slopes = np.where(rays[:, 2] == 0, FLAT, rays[:, 2])
        ends = np.sort(np.array([[-self.half], [self.half]] - start[2]) / slopes, axis=0)
        enter, leave = np.maximum(side_in, ends[0]), np.minimum(side_out, ends[1])
        outwards = (start[:2] + side_in[:, None] * rays[:, :2]) / self.radius
        on_side = np.abs(np.einsum("ij,ij->i", outwards, rays[:, :2]))
        return enter, leave, np.where(side_in > ends[0], on_side, np.abs(rays[:, 2]))


@dataclass(frozen=True, eq=False)
class Ellipsoid(Solid):
    """An ellipsoid with semi-axes `radii` (3,) along the axes of its frame."""

    radii: Array

    @property
    def reach(self) -> float:
        """The longest semi-axis."""
        return float(self.radii.max())

    def _clearance(self, points: Array) -> Array:
        inner = (np.linalg.norm(points / self.radii, axis=1) - 1) * self.radii.min()
        outer = np.linalg.norm(points, axis=1) - self.radii.max()
        aside = (np.abs(points) - self.radii).max(axis=1)
        gaps: Array = np.maximum(np.maximum(inner, outer), aside)
        return gaps

    def _cross(self, start: Array, rays: Array) -> tuple[Array, Array, Array]:
        enter, leave = _quadric(start / self.radii, rays / self.radii, 1.0)
        normals = (start + enter[:, None] * rays) / self.radii**2
        cosines = np.abs(np.einsum("ij,ij->i", normals, rays)) / np.linalg.norm(normals, axis=1)
        return enter, leave, cosines


def _quadric(start: Array, rays: Array, radius: float) -> tuple[Array, Array]:
    """Where rays (N, D) enter and leave a ball about the origin (N,); NaN where they miss."""
    a, b = np.einsum("ij,ij->i", rays, rays), rays @ start
    root = np.sqrt(b**2 - a * (start @ start - radius**2))
    return (-b - root) / a, (-b + root) / a
