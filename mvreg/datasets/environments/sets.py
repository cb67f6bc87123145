"""The embedded environments as data sets: which scene, which instrument, from where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.datasets.environments.base import Environment
from mvreg.datasets.environments.effects import RangeError
from mvreg.datasets.environments.instruments import (
    DepthCamera,
    Instrument,
    Panorama,
    RotatingLidar,
)
from mvreg.datasets.environments.scene import Scene
from mvreg.types import Array

if TYPE_CHECKING:
    from mvreg.datasets.environments import street
    from mvreg.datasets.environments.plan import Site

#: Of a terrestrial laser scanner, of a rotating LiDAR, of a depth camera with structured light.
PHASE_SCANNER = RangeError(constant=0.001, linear=0.0001)
TIME_OF_FLIGHT = RangeError(constant=0.015, linear=0.0002, step=0.004)
STRUCTURED_LIGHT = RangeError(constant=0.001, quadratic=0.0015, disparity=0.0029)


@dataclass(frozen=True)
class Stationary(Environment):
    """A site that a laser scanner on a tripod, levelled, is carried through."""

    rays: int = 20_000

    def site(self) -> Site:
        """The scene, and the path of the scanner; for subclasses to define."""
        raise NotImplementedError

    def scene(self) -> Scene:
        """What is scanned."""
        return self.site().scene

    def _instrument(self) -> Instrument:
        return Panorama(**_settings(self), error=PHASE_SCANNER, lowest=-60, highest=85)

    def _set_up(self, rng: np.random.Generator) -> tuple[Scene, list[Array]]:
        site = self.site()
        return site.scene, site.tripods(self.scans, rng)


@dataclass(frozen=True)
class Room(Stationary):
    """A living room of about 7 by 6 m, furnished, scanned all around from a few tripods."""

    def site(self) -> Site:
        """The room."""
        from mvreg.datasets.environments.room import room

        return room(self.variant)


@dataclass(frozen=True)
class Office(Stationary):
    """Three rooms and a corridor, joined by open doors, scanned all around from tripods."""

    scans: int = 16

    def site(self) -> Site:
        """The office."""
        from mvreg.datasets.environments.office import office

        return office(self.variant)


@dataclass(frozen=True)
class Yard(Stationary):
    """A closed courtyard, the same after half a turn but for a few small things: a trap."""

    scans: int = 8

    def site(self) -> Site:
        """The yard."""
        from mvreg.datasets.environments.yard import yard

        return yard(self.variant)


@dataclass(frozen=True)
class Street(Environment):
    """A street in a bend, driven along by a car with a LiDAR of 32 beams, a scan every 3 to 5 m."""

    scans: int = 20
    rays: int = 24_000
    mixed: float = 0.05
    nearest: float = 1.5
    farthest: float = 50.0

    def scene(self) -> Scene:
        """The street, long enough for all stations."""
        return self._street().scene

    def _street(self) -> street.Street:
        from mvreg.datasets.environments.street import street

        return street(self.variant, 5.0 * self.scans)

    def _instrument(self) -> Instrument:
        return RotatingLidar(**_settings(self), error=TIME_OF_FLIGHT)

    def _set_up(self, rng: np.random.Generator) -> tuple[Scene, list[Array]]:
        driven = self._street()
        return driven.scene, driven.drive(self.scans, rng)


@dataclass(frozen=True)
class Desk(Environment):
    """A desk with what lies on it, seen by a depth camera from around it, held by hand."""

    scans: int = 8
    rays: int = 19_200
    mixed: float = 0.2
    grazing: float = 80.0
    nearest: float = 0.4
    farthest: float = 4.0

    def scene(self) -> Scene:
        """The desk."""
        from mvreg.datasets.environments.desk import desk

        return desk(self.variant)

    def _instrument(self) -> Instrument:
        return DepthCamera(**_settings(self), error=STRUCTURED_LIGHT)

    def _set_up(self, rng: np.random.Generator) -> tuple[Scene, list[Array]]:
        from mvreg.datasets.environments.desk import around

        return self.scene(), around(self.scans, rng)


def _settings(dataset: Environment) -> dict[str, Any]:
    """What data sets and instruments call the same."""
    keys = ("rays", "noise", "mixed", "lost", "grazing", "nearest", "farthest")
    return {key: getattr(dataset, key) for key in keys}
