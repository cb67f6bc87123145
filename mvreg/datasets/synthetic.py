"""The embedded data sets: scans of a figure that exists in code only, with exact poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.datasets.base import ScanSource
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.types import Array, Scan, ScanSet

#: Elevations of the sensor (degrees), one after another, over and over.
ELEVATIONS = (12.0, 34.0, 14.0, -16.0)
#: From the sensor to the figure's centre, in sizes of the figure.
DISTANCE = 2.5


@dataclass(frozen=True)
class Figurine(ScanSource):
    """A gnome, 150 mm tall, seen all around by a virtual range camera; poses are exact.

    The views go around in steps of 30 to 40 degrees, now from above, now from below, as one would
    walk around by hand. The scans are the same whatever the run's random numbers are.

    Parameters
    ----------
    views : int
        Number of scans.
    points : int
        Points per scan, about.
    noise : float
        Standard deviation of the range (mm); 0.08 is about a seventh of the spacing of the points.
    quantisation : float
        Step of the range (mm).
    shape : str
        Which figure: gnome, blob-0, blob-1, ..., or one too plain to be registered: sphere, plate,
        box, cylinder, bottle.
    noise_rng : int
        Another number, other noise and slightly other viewpoints.
    widest_step : float
        Neighbouring views are at most so far apart around the figure (degrees); as few views as do
        not reach around it see a part of it only.
    """

    views: int = 12
    points: int = 30_000
    noise: float = 0.08
    quantisation: float = 0.02
    shape: str = "gnome"
    noise_rng: int = 0
    widest_step: float = 40.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for key, least in (("views", 1), ("points", 100), ("noise", 0), ("quantisation", 0),
                           ("noise_rng", 0), ("widest_step", 0)):  # fmt: skip
            if not getattr(self, key) >= least:
                raise InputError(f"dataset.{key}={getattr(self, key)}: expected {least} or more")

    @property
    def name(self) -> str:
        """The class's name in lower case; other shapes add theirs."""
        name = type(self).__name__.lower()
        return name if self.shape == "gnome" else f"{name}_{self.shape}"

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Scan the figure; `rng` is not used.

        Raises
        ------
        InputError
            If there is no such shape.
        """
        from mvreg.datasets.camera import RangeCamera
        from mvreg.datasets.shapes import shape

        mesh = shape(self.shape)
        own_rng = np.random.default_rng(self.noise_rng)
        camera = RangeCamera(self.points, noise=self.noise, quantisation=self.quantisation)
        # Scanners report positions in their measuring volume, and so do these: with its origin at
        # the sensor, an error of rotation would show as one of translation, ten times too large.
        standoff = se3.from_parts(np.eye(3), np.array([0, 0, DISTANCE * mesh.size]))
        scans: list[Scan] = []
        poses: dict[str, Array] = {}
        step = min(self.widest_step, 360 / self.views)
        viewpoints = _viewpoints(self.views, step, mesh.centre, mesh.size, own_rng)
        for index, pose in enumerate(viewpoints):
            name = f"{self.name}_{index:02d}"
            scan = camera(mesh, pose, own_rng, name)
            scans.append(scan.moved(standoff))
            poses[name] = pose @ se3.invert(standoff)
        return ScanSet(self.name, tuple(scans), "mm", poses)


@dataclass(frozen=True)
class Tiny(Figurine):
    """The figurine in six small scans, for tests: 200 degrees around it, at 1.3 mm a point."""

    views: int = 6
    points: int = 6_000


def _viewpoints(
    count: int, step: float, centre: Array, size: float, rng: np.random.Generator
) -> list[Array]:
    """Poses ``T_world_scan`` around the figure, held by hand: near a circle, never quite on it.

    From one to the next are `step` degrees.
    """
    from mvreg.datasets.viewpoints import orbit

    poses = []
    for index in range(count):
        wobble = rng.uniform(-1, 1, size=4) * [4, 4, 12, 0.06]
        elevation = ELEVATIONS[index % len(ELEVATIONS)] + wobble[1]
        distance = DISTANCE * size * (1 + wobble[3])
        poses.append(orbit(centre, distance, index * step + wobble[0], elevation, wobble[2]))
    return poses
