"""Places in code of kinds that the default method was not made with, for `kinds`; lengths in m."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mvreg.datasets.environments import furniture, outdoors
from mvreg.datasets.environments.build import at, between, box, pillar, put, wall
from mvreg.datasets.environments.instruments import Instrument, Panorama, RotatingLidar
from mvreg.datasets.environments.plan import Plan, Site, dense
from mvreg.datasets.environments.room import shell
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.environments.sets import Stationary, Street
from mvreg.datasets.environments.solids import Solid
from mvreg.types import Array


@dataclass(frozen=True)
class Facade(Stationary):
    """Three houses whose windows repeat, scanned from tripods across the street, 5 m apart."""

    scans: int = 7
    rays: int = 40_000
    farthest: float = 28.0

    def _instrument(self) -> Instrument:
        full = super()._instrument()
        assert isinstance(full, Panorama)
        return replace(full, highest=70.0)

    def _set_up(self, rng: np.random.Generator) -> tuple[Scene, list[Array]]:
        own = np.random.default_rng([self.variant, 0xFACADE])
        half, width = 18.0, 12.0
        solids: list[Solid] = [between((-60, -30, -0.3), (60, 60, 0))]
        for x in (-width, 0, width):
            solids += put(outdoors.facade(own, width, int(own.integers(3, 5)), roof=False), x, 0)
        for x in own.uniform(-half, half, 5):
            pieces = [outdoors.lamp_post(5.0), outdoors.sign(own), outdoors.bins(own, 2),
                      outdoors.bench(), outdoors.planter(own, 1.5)]  # fmt: skip
            solids += put(pieces[own.integers(5)], x, own.uniform(1.5, 4.0), turn=180)
        along = np.linspace(-0.85 * half, 0.85 * half, self.scans)
        return Scene(tuple(solids)), [
            at(x + rng.uniform(-1, 1), rng.uniform(7, 10), rng.uniform(1.5, 1.7),
               float(rng.uniform(0, 360))) for x in along
        ]  # fmt: skip


@dataclass(frozen=True)
class Hall(Stationary):
    """A hall with two rows of columns; `alike`: the same after half a turn, less what stands there.

    Else its ends have other doors, and one a platform.
    """

    scans: int = 10
    rays: int = 20_000
    alike: bool = False

    def site(self) -> Site:
        """32 by 14 m, 6 m high."""
        rng = np.random.default_rng([self.variant, 0x4A11])
        length, width, height = 32.0, 14.0, 6.0
        corners = [(4.0, 5.2), (28.0, 5.2), (28.0, 8.8), (4.0, 8.8)]
        size = np.array([length, width])
        plan = Plan(np.zeros(2), size, dense(corners, closed=True))
        windows = [(x, x + 1.6, 1.2, 4.0) for x in np.arange(1.2, length - 2, 3.2)]
        doors = [(width / 2 - 1, width / 2 + 1, 0.001, 2.6)]
        others = doors if self.alike else [(2.0, 3.2, 0.001, 2.2), (9.0, 11.0, 0.001, 2.6)]
        solids = [
            *shell(np.zeros(2), size, height),
            *wall((0, width), (length, width), height, windows, 0.4),
            *wall((length, 0), (0, 0), height, windows, 0.4),
            *wall((length, width), (length, 0), height, doors, 0.4),
            *wall((0, 0), (0, width), height, others, 0.4),
        ]
        if not self.alike:
            solids.append(box((2.2, width - 4, 0.6), (length - 1.1, width / 2, 0)))
            plan.take(np.array([length - 1.1, width / 2]), np.array([2.2, width - 4]))
        for x in np.arange(4.0, length - 2, 4.8):
            for y in (3.2, width - 3.2):
                solids.append(pillar(0.3, height, (x, y, 0)))
                plan.take(np.array([x, y]), np.full(2, 0.6))
        for _ in range(4):
            wide, tall = rng.uniform([1.0, 0.9], [2.2, 2.0])
            solids += plan.along_wall(rng, furniture.cupboard(rng, wide, tall), wide, 0.55)
            solids += plan.anywhere(rng, outdoors.bench(), 1.8, 0.6)
            solids += plan.anywhere(rng, furniture.plant(rng), 0.6, 0.6)
        solids += plan.anywhere(rng, [box((2.4, 0.8, 1.1), (0, 0, 0))], 2.4, 0.8)
        return Site(Scene(tuple(solids)), np.array(corners), closed=True)


@dataclass(frozen=True)
class Car(Street):
    """A street, scanned from a car by a LiDAR of 64 beams, a scan every 6 to 10 m."""

    scans: int = 5
    rays: int = 57_600
    farthest: float = 60.0

    def _instrument(self) -> Instrument:
        lidar = super()._instrument()
        assert isinstance(lidar, RotatingLidar)
        return replace(lidar, beams=64, lowest=-24.8, highest=2.0)

    def _set_up(self, rng: np.random.Generator) -> tuple[Scene, list[Array]]:
        driven = replace(self, scans=2 * self.scans)._street()
        return driven.scene, driven.drive(2 * self.scans, rng)[::2]


@dataclass(frozen=True)
class SolidStateLidar(Instrument):
    """A LiDAR that looks ahead, 80 by 25 degrees, its beams all over that; x is ahead, z up."""

    def _width(self) -> float:
        return float(np.sqrt(np.radians(80) * np.radians(25) / self.rays))

    def _directions(self) -> Array:
        rng, step = np.random.default_rng(0), self._width()
        rows, columns = round(np.radians(25) / step), round(np.radians(80) / step)
        a = step * (np.arange(columns) - columns / 2 + rng.random((rows, columns)))
        e = step * (np.arange(rows)[:, None] - rows / 2 + rng.random((rows, columns)))
        return np.stack([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)], axis=-1)

    def _wraps(self) -> bool:
        return False


@dataclass(frozen=True)
class SolidState(Street):
    """A street, scanned by a solid-state LiDAR from a car that swerves, every 3 to 5 m."""

    scans: int = 26
    rays: int = 20_000
    farthest: float = 60.0

    def _instrument(self) -> Instrument:
        full = super()._instrument()
        names = ("rays", "error", "noise", "mixed", "lost", "grazing", "nearest", "farthest")
        return SolidStateLidar(**{name: getattr(full, name) for name in names})

    def _set_up(self, rng: np.random.Generator) -> tuple[Scene, list[Array]]:
        scene, stations = super()._set_up(rng)
        return scene, [pose @ at(0, 0, turn=float(rng.normal(scale=8.0))) for pose in stations]
