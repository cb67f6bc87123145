"""What all embedded environments have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.datasets.base import ScanSource
from mvreg.datasets.environments.instruments import Instrument
from mvreg.datasets.environments.scene import Scene
from mvreg.errors import InputError
from mvreg.types import Array, Scan, ScanSet


@dataclass(frozen=True)
class Environment(ScanSource):
    """A scene in code, scanned by a virtual instrument; poses are exact, lengths in metres.

    The scene depends on its `variant` only; stations and errors are drawn from the run's random
    numbers. Each scan is in the frame of its instrument, whose origin the rays start from.

    Parameters
    ----------
    scans : int
        Number of scans.
    rays : int
        Rays per scan, about; those that meet nothing in reach, or are lost, give no point.
    noise : float
        Factor on the instrument's own errors of range; with ``noise=0 mixed=0`` points are exact.
    mixed : float
        Share of the pixels at depth edges whose range is between those of the two surfaces.
    lost : float
        Share of the points that are lost at random.
    grazing : float
        Angle of incidence (degrees) from which on more and more points are lost; 90 loses none.
    nearest, farthest : float
        Ranges that are not between these are lost (m).
    variant : int
        Another number, another scene of the kind.
    """

    scans: int = 6
    rays: int = 15_000
    noise: float = 1.0
    mixed: float = 0.1
    lost: float = 0.02
    grazing: float = 82.0
    nearest: float = 0.5
    farthest: float = 100.0
    variant: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks = {
            "scans": (self.scans >= 1, "1 or more"), "rays": (self.rays >= 500, "500 or more"),
            "noise": (self.noise >= 0, "0 or more"), "mixed": (0 <= self.mixed <= 1, "0 to 1"),
            "lost": (0 <= self.lost < 1, "0 or more, below 1"),
            "grazing": (0 <= self.grazing <= 90, "0 to 90"),
            "nearest": (self.nearest >= 0, "0 or more"),
            "farthest": (self.farthest > self.nearest, f"more than nearest={self.nearest}"),
            "variant": (self.variant >= 0, "0 or more"),
        }  # fmt: skip
        for key, (valid, expected) in checks.items():
            if not valid:
                raise InputError(f"dataset.{key}={getattr(self, key)}: expected {expected}")

    @property
    def name(self) -> str:
        """The class's name in lower case; other variants add their number."""
        name = type(self).__name__.lower()
        return f"{name}_{self.variant}" if self.variant else name

    def scene(self) -> Scene:
        """What is scanned; for subclasses to define."""
        raise NotImplementedError

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Choose the stations, then scan from each.

        Raises
        ------
        InputError
            If a scan has no point.
        """
        (scene, stations), instrument = self._set_up(rng), self._instrument()
        poses: dict[str, Array] = {}
        scans: list[Scan] = []
        for index, pose in enumerate(stations):
            name = f"{self.name}_{index:02d}"
            scans.append(Scan(name, instrument(scene, pose, rng), view_point=np.zeros(3)))
            poses[name] = pose
        return ScanSet(self.name, tuple(scans), "m", poses)

    def _instrument(self) -> Instrument:
        raise NotImplementedError

    def _set_up(self, rng: np.random.Generator) -> tuple[Scene, list[Array]]:
        """What is scanned, and from where.

        Poses ``T_world_scan`` (4, 4) of the instrument, neighbours one after the other.
        """
        raise NotImplementedError
