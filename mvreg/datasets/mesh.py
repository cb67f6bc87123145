"""Triangle meshes to look at with a virtual camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mvreg.types import Array, Indices


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles, counter-clockwise seen from outside.

    Parameters
    ----------
    vertices : (V, 3) array
        In the world frame.
    triangles : (T, 3) array
        Indices of vertices.
    """

    vertices: Array
    triangles: Indices

    @cached_property
    def corners(self) -> Array:
        """The corners (8, 3) of the bounding box."""
        box = self.vertices.min(axis=0), self.vertices.max(axis=0)
        corners: Array = np.stack(np.meshgrid(*zip(*box, strict=True)), axis=-1).reshape(8, 3)
        return corners

    @property
    def centre(self) -> Array:
        """The middle (3,) of the bounding box."""
        middle: Array = (self.corners[0] + self.corners[-1]) / 2
        return middle

    @property
    def size(self) -> float:
        """The diagonal of the bounding box (length)."""
        return float(np.linalg.norm(self.corners[-1] - self.corners[0]))

    @cached_property
    def scene(self) -> Any:
        """Open3D's ray caster over the mesh moved by ``-centre``, so that float32 suffices."""
        from mvreg._open3d import load_open3d

        open3d = load_open3d()
        scene = open3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            open3d.core.Tensor(np.ascontiguousarray(self.vertices - self.centre, dtype=np.float32)),
            open3d.core.Tensor(np.ascontiguousarray(self.triangles, dtype=np.uint32)),
        )
        return scene


def cuboid(x: float, y: float, z: float) -> tuple[Array, Indices]:
    """Vertices and triangles of a box with these edges, around the origin."""
    signs = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
    quads = np.array(
        [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    )
    return signs * [x / 2, y / 2, z / 2], np.vstack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def lathe(profile: Array, steps: int = 360) -> tuple[Array, Indices]:
    """Turn a profile around the z axis.

    Parameters
    ----------
    profile : (N, 2) array
        Radius and height, upwards; the first and the last radius are 0.
    steps : int
        Number of flat pieces around.

    Returns
    -------
    vertices, triangles : (V, 3) and (T, 3) arrays
    """
    angle = 2 * np.pi * np.arange(steps) / steps
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    inner = profile[1:-1]
    around = (inner[:, None, :1] * ring).reshape(-1, 2)
    vertices = np.vstack([
        (0, 0, profile[0, 1]),
        np.column_stack([around, np.repeat(inner[:, 1], steps)]),
        (0, 0, profile[-1, 1]),
    ])  # fmt: skip
    this, following = np.arange(steps), np.roll(np.arange(steps), -1)
    rows = 1 + steps * np.arange(len(inner) - 1)[:, None]
    a, b = (rows + this).ravel(), (rows + following).ravel()
    last = len(vertices) - 1
    top = last - steps
    return vertices, np.vstack([
        np.column_stack([np.zeros(steps, dtype=int), 1 + following, 1 + this]),
        np.column_stack([a, b, b + steps]), np.column_stack([a, b + steps, a + steps]),
        np.column_stack([top + this, top + following, np.full(steps, last)]),
    ])  # fmt: skip
