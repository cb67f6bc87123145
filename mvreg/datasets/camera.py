"""A virtual range camera."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mvreg.datasets.mesh import Mesh
from mvreg.datasets.raycast import Hits, Picture, Projection
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.types import Array, Scan

#: Rays that find out how much of the picture the object fills.
PROBE = 4096
#: No more rays than this are cast for each point wanted.
MOST_RAYS = 50


@dataclass(frozen=True)
class RangeCamera:
    """A range camera: x to the right, y up, looking along -z, so that +z is towards the sensor.

    The grid of pixels is laid around what is seen of the object, and is as fine as the number of
    points asks for. With ``noise=0, quantisation=0`` the points lie on the mesh exactly.

    Parameters
    ----------
    points : int
        Number of points wanted; the scan has about as many, within 20 per cent.
    projection : Projection
        ``perspective``: from a point, as a structured-light sensor or a scanner on a tripod;
        ``orthographic``: from far away.
    field_of_view : float
        Full angle (degrees) of a perspective camera; what is outside is not seen.
    window : float
        Full width (length) of an orthographic camera.
    noise : float
        Standard deviation of the range (length), Gaussian.
    quantisation : float
        The range is rounded to multiples of this (length); 0 does not round.
    grazing : float
        Angle between ray and normal (degrees) beyond which points are lost, more and more of them
        up to 90 degrees, where none is left; 90 loses none.
    edge_dropout : float
        Share of the points lost where the surface ends or the range jumps, by more than
        `edge_jump` times the width of a pixel there. 84 degrees of incidence make a jump of 10.
    """

    points: int = 30_000
    projection: Projection = Projection.perspective
    field_of_view: float = 70.0
    window: float = math.inf
    noise: float = 0.0
    quantisation: float = 0.0
    grazing: float = 75.0
    edge_dropout: float = 0.5
    edge_jump: float = 10.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "projection", Projection(self.projection))
        checks = {
            "points": self.points >= 1, "field_of_view": 0 < self.field_of_view < 180,
            "window": self.window > 0, "noise": self.noise >= 0,
            "quantisation": self.quantisation >= 0, "grazing": 0 <= self.grazing <= 90,
            "edge_dropout": 0 <= self.edge_dropout <= 1, "edge_jump": self.edge_jump > 0,
        }  # fmt: skip
        for key, valid in checks.items():
            if not valid:
                raise InputError(f"range camera: {key}={getattr(self, key)} is out of range")

    def __call__(
        self, mesh: Mesh, T_world_scan: Array, rng: np.random.Generator, name: str = "scan"
    ) -> Scan:
        """Scan the mesh, given in the world frame, from the pose (4, 4) of the sensor.

        Returns
        -------
        Scan
            In the sensor's frame, so that `T_world_scan` is its ground truth, row by row of the
            picture from below. It has a `view_point`, the origin, or a `view_direction`, +z.

        Raises
        ------
        InputError
            If nothing of the mesh is seen, or all the points are lost.
        """
        picture = self._frame(mesh, T_world_scan)
        points = np.empty((0, 3))
        if picture is not None:
            hits = picture.cast(mesh, T_world_scan)
            share = self._chances(hits.cosines).sum() / hits.inside.size
            finer = math.sqrt(PROBE * max(share, 1 / MOST_RAYS) / self.points)
            picture = replace(picture, pixel=picture.pixel * finer)
            points = self._measure(picture, picture.cast(mesh, T_world_scan), rng)
        if len(points) == 0:
            raise InputError(
                f"scan {name!r}: the range camera sees nothing of the mesh; expected T_world_scan "
                "to turn its -z axis towards it"
            )
        if self.projection is Projection.perspective:
            return Scan(name, points, view_point=np.zeros(3))
        return Scan(name, points, view_direction=np.array([0.0, 0.0, 1.0]))

    def _frame(self, mesh: Mesh, T_world_scan: Array) -> Picture | None:
        """A coarse picture of the mesh's bounding box; None where it is out of sight."""
        seen = se3.apply(se3.invert(T_world_scan), mesh.corners)
        half = np.full(2, self.window / 2)
        if self.projection is Projection.perspective:
            half[:] = math.tan(math.radians(self.field_of_view / 2))
            if seen[:, 2].min() >= 0:
                return None
            if seen[:, 2].max() < -1e-3 * mesh.size:
                seen = seen[:, :2] / -seen[:, 2:]
            else:  # Some of it is beside or behind the camera.
                seen = np.array([-half, half])
        lower = np.maximum(seen[:, :2].min(axis=0), -half)
        upper = np.minimum(seen[:, :2].max(axis=0), half)
        if (upper <= lower).any():
            return None
        pixel = math.sqrt(float(np.prod(upper - lower)) / PROBE)
        return Picture(self.projection, lower, upper, pixel)

    def _chances(self, cosines: Array) -> Array:
        """The probabilities that points survive, given the cosines of the angles of incidence."""
        if self.grazing == 90:
            return np.ones_like(cosines)
        angles = np.degrees(np.arccos(np.clip(cosines, 0, 1)))
        chances: Array = np.clip((90 - angles) / (90 - self.grazing), 0, 1)
        return chances

    def _measure(self, picture: Picture, hits: Hits, rng: np.random.Generator) -> Array:
        """Points (N, 3) as measured, less those that are lost."""
        if self.projection is Projection.perspective:
            ranges = np.linalg.norm(hits.points, axis=1)
            rays, pixels = hits.points / ranges[:, None], picture.pixel * ranges
        else:
            ranges, pixels = -hits.points[:, 2], np.full(len(hits.points), picture.pixel)
            rays = np.broadcast_to([0.0, 0.0, -1.0], hits.points.shape)
        edges = hits.widest_steps(ranges) > self.edge_jump * pixels
        chances = self._chances(hits.cosines) * np.where(edges, 1 - self.edge_dropout, 1)
        kept = rng.random(len(chances)) < chances
        points, rays, ranges = hits.points[kept], rays[kept], ranges[kept]
        measured = ranges + self.noise * rng.standard_normal(len(ranges))
        if self.quantisation > 0:
            measured = self.quantisation * np.round(measured / self.quantisation)
        moved: Array = points + (measured - ranges)[:, None] * rays
        return moved
