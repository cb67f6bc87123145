"""Virtual instruments: a scanner on a tripod, a rotating LiDAR, a depth camera."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mvreg.datasets.environments.effects import RangeError, mix, survivors
from mvreg.datasets.environments.scene import Scene
from mvreg.errors import InputError
from mvreg.types import Array


@dataclass(frozen=True)
class Instrument:
    """Casts a grid of rays from one point; subclasses say which rays, in the sensor's frame.

    Parameters
    ----------
    rays : int
        Number of rays, about; those that meet nothing, or are lost, give no point.
    error : RangeError
        Of the ranges.
    noise : float
        Factor on the error; with 0, and nothing mixed, points are exact.
    mixed : float
        Share of the pixels at depth edges whose range is between those of the two surfaces.
    lost : float
        Share of the points that are lost at random.
    grazing : float
        Angle of incidence (degrees) from which on more and more points are lost; 90 loses none.
    nearest, farthest : float
        Ranges that are not between these are lost (m).
    """

    rays: int = 15_000
    error: RangeError = field(default_factory=RangeError)
    noise: float = 1.0
    mixed: float = 0.0
    lost: float = 0.0
    grazing: float = 82.0
    nearest: float = 0.0
    farthest: float = math.inf

    def __post_init__(self) -> None:
        checks = {
            "rays": self.rays >= 1, "noise": self.noise >= 0, "mixed": 0 <= self.mixed <= 1,
            "lost": 0 <= self.lost <= 1, "grazing": 0 <= self.grazing <= 90,
            "nearest": self.nearest >= 0, "farthest": self.farthest > self.nearest,
        }  # fmt: skip
        for key, valid in checks.items():
            if not valid:
                raise InputError(f"instrument: {key}={getattr(self, key)} is out of range")

    def __call__(self, scene: Scene, T_world_scan: Array, rng: np.random.Generator) -> Array:
        """Scan the scene.

        Returns
        -------
        (N, 3) array
            In the sensor's frame, whose origin is where all rays start; row by row.
        """
        grid = self._directions()
        shape, rays = grid.shape[:2], grid.reshape(-1, 3)
        ranges, cosines = scene.cast(
            T_world_scan[:3, 3], rays @ T_world_scan[:3, :3].T, self.farthest
        )
        picture = mix(ranges.reshape(shape), self._width(), self.mixed, self._wraps(), rng)
        kept = survivors(picture, cosines.reshape(shape), self.lost, self.grazing, rng)
        forward = self._forward(rays).reshape(shape)
        seen = np.where(np.isfinite(picture), picture, 1.0) * forward
        measured = self.error(seen, self.noise, rng) / forward
        kept = kept & (measured >= self.nearest) & (measured <= self.farthest)
        points: Array = grid[kept] * measured[kept][:, None]
        return points

    def _directions(self) -> Array:
        """Unit vectors (rows, columns, 3) in the sensor's frame."""
        raise NotImplementedError

    def _width(self) -> float:
        """Angle between neighbouring pixels (radians), the larger of both directions."""
        raise NotImplementedError

    def _wraps(self) -> bool:
        return True

    def _forward(self, rays: Array) -> Array:
        """What is measured along rays (N, 3), in units of their length: (N,)."""
        return np.ones(len(rays))


def _around(azimuths: Array, elevations: Array) -> Array:
    """Directions (rows, columns, 3), z up, one row for each elevation (radians)."""
    a, e = azimuths[None], elevations[:, None]
    level = np.cos(e)
    up = np.broadcast_to(np.sin(e), (len(elevations), len(azimuths)))
    return np.stack([np.cos(a) * level, np.sin(a) * level, up], axis=-1)


@dataclass(frozen=True)
class Panorama(Instrument):
    """A terrestrial laser scanner: all around, in equal steps of azimuth and elevation; z is up.

    Parameters
    ----------
    lowest, highest : float
        Elevations of the first and the last row (degrees); below is the blind cone over the tripod.
    """

    lowest: float = -60.0
    highest: float = 85.0

    def _width(self) -> float:
        share = math.radians(self.highest - self.lowest)
        return math.sqrt(math.tau * share / self.rays)

    def _directions(self) -> Array:
        step, low, high = self._width(), math.radians(self.lowest), math.radians(self.highest)
        columns = max(round(math.tau / step), 1)
        rows = max(round((high - low) / step), 1)
        return _around(
            math.tau * np.arange(columns) / columns, low + (high - low) * np.arange(rows) / rows
        )


@dataclass(frozen=True)
class RotatingLidar(Instrument):
    """A rotating LiDAR, some beams one above the other; x is ahead, z is up.

    Parameters
    ----------
    beams : int
    lowest, highest : float
        Elevations of the first and the last beam (degrees).
    """

    beams: int = 32
    lowest: float = -25.0
    highest: float = 15.0

    def _width(self) -> float:
        return math.radians(self.highest - self.lowest) / max(self.beams - 1, 1)

    def _directions(self) -> Array:
        columns = max(round(self.rays / self.beams), 1)
        elevations = np.radians(np.linspace(self.lowest, self.highest, self.beams))
        return _around(math.tau * np.arange(columns) / columns, elevations)


@dataclass(frozen=True)
class DepthCamera(Instrument):
    """A depth camera, four by three: x to the right, y up, looking along -z; it errs in depth.

    Parameters
    ----------
    field_of_view : float
        Horizontal, full angle (degrees).
    """

    field_of_view: float = 60.0

    def _width(self) -> float:
        return 2 * self._edge() / self._columns()

    def _edge(self) -> float:
        return math.tan(math.radians(self.field_of_view / 2))

    def _columns(self) -> int:
        return max(round(math.sqrt(self.rays * 4 / 3)), 1)

    def _directions(self) -> Array:
        columns = self._columns()
        rows = max(round(columns * 3 / 4), 1)
        x = self._width() * (np.arange(columns) - (columns - 1) / 2)
        y = self._width() * (np.arange(rows) - (rows - 1) / 2)
        plane = np.stack([*np.meshgrid(x, y), -np.ones((rows, columns))], axis=-1)
        rays: Array = plane / np.linalg.norm(plane, axis=-1, keepdims=True)
        return rays

    def _wraps(self) -> bool:
        return False

    def _forward(self, rays: Array) -> Array:
        return -rays[:, 2]
