"""The rays of a range picture, and where they meet a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from mvreg.datasets.mesh import Mesh
from mvreg.geometry import se3
from mvreg.types import Array


class Projection(Enum):
    """Where the rays of a camera come from: one point, or a plane."""

    perspective = "perspective"
    orthographic = "orthographic"


@dataclass(frozen=True, eq=False)
class Picture:
    """A grid of square pixels that spans from `lower` (2,) to `upper` (2,), with edges of `pixel`.

    Units are lengths in the plane z = 0 for an orthographic projection, tangents for a perspective
    one, that is lengths in the plane z = -1.
    """

    projection: Projection
    lower: Array
    upper: Array
    pixel: float

    def cast(self, mesh: Mesh, T_world_scan: Array) -> Hits:
        """Find the first hit of the ray through the centre of every pixel."""
        from mvreg._open3d import load_open3d

        rays = self._rays(T_world_scan, mesh.centre)
        found = mesh.scene.cast_rays(load_open3d().core.Tensor(rays))
        inside = np.isfinite(found["t_hit"].numpy())
        triangle = found["primitive_ids"].numpy()[inside]
        # Open3D's float32 only says which triangle, and where on it: the point is exact.
        u, v = found["primitive_uvs"].numpy()[inside].astype(np.float64).T[:, :, None]
        a, b, c = (mesh.vertices[corner] for corner in mesh.triangles[triangle].T)
        points = se3.apply(se3.invert(T_world_scan), a + u * (b - a) + v * (c - a))
        normals, directions = found["primitive_normals"].numpy()[inside], rays[inside][:, 3:]
        lengths = np.linalg.norm(normals, axis=1) * np.linalg.norm(directions, axis=1)
        cosines = np.abs(np.einsum("ij,ij->i", normals, directions)) / np.maximum(lengths, 1e-30)
        return Hits(inside, points, cosines.astype(np.float64))

    def _rays(self, T_world_scan: Array, origin: Array) -> NDArray[np.float32]:
        """(rows, columns, 6) starts and directions in the world frame moved by ``-origin``."""
        counts = np.maximum(np.ceil((self.upper - self.lower) / self.pixel).astype(int), 1)
        x, y = (
            start + self.pixel * (np.arange(count) + 0.5)
            for start, count in zip(self.lower, counts, strict=True)
        )
        rotation, start = T_world_scan[:3, :3], T_world_scan[:3, 3] - origin
        plane = y[:, None, None] * rotation[:, 1] + x[:, None] * rotation[:, 0]
        rays = np.empty((len(y), len(x), 6), dtype=np.float32)
        if self.projection is Projection.perspective:
            rays[..., :3], rays[..., 3:] = start, plane - rotation[:, 2]
        else:
            rays[..., :3], rays[..., 3:] = start + plane, -rotation[:, 2]
        return rays


@dataclass(frozen=True, eq=False)
class Hits:
    """Where rays met the mesh.

    `inside` (rows, columns) says which did; `points` (N, 3) are in the sensor's frame, row by row;
    `cosines` (N,) are of the angles between ray and normal.
    """

    inside: NDArray[np.bool_]
    points: Array
    cosines: Array

    def widest_steps(self, ranges: Array) -> Array:
        """For each hit the largest difference of `ranges` (N,) to the four pixels around it (N,).

        Infinite where one of them is not a hit, and at the border of the picture.
        """
        padded = np.full(np.add(self.inside.shape, 2), np.inf)
        image = padded[1:-1, 1:-1]
        image[self.inside] = ranges
        steps = [
            np.abs(padded[row : row + image.shape[0], column : column + image.shape[1]][self.inside]
                   - ranges)
            for row, column in ((0, 1), (2, 1), (1, 0), (1, 2))
        ]  # fmt: skip
        widest: Array = np.max(steps, axis=0)
        return widest
