"""A street in a bend: houses on both sides, trees, parked cars, lamps, signs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mvreg.datasets.environments import outdoors
from mvreg.datasets.environments.build import at, between, box, pillar, put
from mvreg.datasets.environments.scene import Scene, moved
from mvreg.datasets.environments.solids import Solid
from mvreg.datasets.relief import turned
from mvreg.geometry import se3
from mvreg.types import Array

#: From the middle of the street to the kerbs, to the parked cars, and to the trees and lamps (m).
KERB, PARKED, TREES = 4.2, 3.15, 4.9
#: The street begins so far before the first station and ends so far behind the last one (m).
MARGIN = 28.0


@dataclass(frozen=True, eq=False)
class Street:
    """A street that begins in the origin, along x, and bends.

    Parameters
    ----------
    scene : Scene
    radius : float
        Of the bend (m), to the left if positive.
    """

    scene: Scene
    radius: float

    def drive(self, count: int, rng: np.random.Generator) -> list[Array]:
        """Poses ``T_world_scan`` of a LiDAR on the roof of a car, 3 to 5 m apart; x is ahead."""
        poses, way = [], 0.0
        for _ in range(count):
            aside, height = rng.uniform(-0.4, 0.4), 1.9 + rng.normal(scale=0.01)
            yaw, pitch, roll = rng.normal(size=3) * [1.5, 0.6, 0.8]
            rotation: Array = turned(z=yaw, y=pitch, x=roll).astype(np.float64)
            sway = se3.from_parts(rotation, np.array([0, aside - 1.2, height]))
            poses.append(frame(self.radius, way) @ sway)
            way += rng.uniform(3, 5)
        return poses


def frame(radius: float, way: float) -> Array:
    """The pose of a frame in the middle of the street, `way` from the origin, x ahead, y left."""
    turn = way / radius
    return at(radius * np.sin(turn), radius * (1 - np.cos(turn)), turn=float(np.degrees(turn)))


@lru_cache(maxsize=8)
def street(variant: int, length: float) -> Street:
    """Another street for each number, long enough for stations along `length`."""
    rng = np.random.default_rng([variant, 0x57EE])
    radius = float(rng.uniform(70, 130) * rng.choice([-1, 1]))
    ends = -MARGIN, length + MARGIN
    solids: list[Solid] = [box((4 * length + 300, 4 * length + 300, 0.5), (0, 0, -0.5))]
    for side, own in zip((1, -1), rng.spawn(2), strict=True):
        houses, clutter = own.spawn(2)
        solids += _houses(houses, radius, side, ends)
        solids += _clutter(clutter, radius, side, ends)
    return Street(Scene(tuple(solids)), radius)


def _beside(
    solids: list[Solid], radius: float, way: float, side: int, aside: float, turn: float = 0.0
) -> list[Solid]:
    """Things beside the street that look across it: their +y is towards its middle."""
    facing = (180.0 if side > 0 else 0.0) + turn
    return moved(solids, frame(radius, way) @ at(0, side * aside, turn=facing))


def _houses(
    rng: np.random.Generator, radius: float, side: int, ends: tuple[float, float]
) -> list[Solid]:
    """Houses wall to wall or with gaps, each with its pavement, kerb and front garden if any."""
    solids: list[Solid] = []
    way = ends[0] + rng.uniform(0, 4)
    while way < ends[1]:
        width = rng.uniform(8, 13)
        garden = rng.uniform(0.0, 2.5) if rng.random() < 0.5 else 0.0
        aside = 7.2 + garden
        # What is straight along the outside of a bend must be longer than along its middle.
        stretch = 1 - side * aside / radius
        house = outdoors.facade(rng, width * stretch, int(rng.integers(2, 4)))
        middle = way + width / 2
        solids += _beside(house, radius, middle, side, aside)
        pavement = between((-width * stretch / 2, -garden, -0.1),
                           (width * stretch / 2, aside - garden - KERB, 0.14))  # fmt: skip
        solids += _beside([pavement], radius, middle, side, aside)
        if garden > 0.8:
            fence = box((width * stretch, 0.08, rng.uniform(0.7, 1.2)), (0, garden - 0.2, 0))
            hedge = outdoors.planter(rng, width * stretch * rng.uniform(0.3, 0.7))
            solids += _beside([fence, *put(hedge, 0.5, garden - 0.6)], radius, middle, side, aside)
        way += width + (rng.uniform(2, 4) if rng.random() < 0.3 else 0.0)
    return solids


def _clutter(
    rng: np.random.Generator, radius: float, side: int, ends: tuple[float, float]
) -> list[Solid]:
    """Along the kerb, one after the other: cars on the road; trees, lamps and bins beside it."""
    solids: list[Solid] = []
    way = ends[0] + rng.uniform(0, 6)
    while way < ends[1]:
        way += rng.uniform(5.2, 6.2)
        if rng.random() < 0.6:
            facing = 180.0 * rng.integers(2) + rng.uniform(-3, 3)
            aside = PARKED + rng.uniform(-0.15, 0.15)
            solids += _beside(outdoors.car(rng), radius, way, side, aside, facing)
        kind = rng.integers(6)
        piece: list[Solid] = [pillar(0.12, 0.9, (0, 0, 0))]
        if kind <= 1:
            piece = outdoors.tree(rng, rng.uniform(5, 8))
        elif kind == 2:
            piece = put(outdoors.lamp_post(rng.uniform(5, 7)), 0, 0, turn=180)
        elif kind == 3:
            piece = outdoors.sign(rng)
        elif kind == 4:
            piece = outdoors.bins(rng, int(rng.integers(1, 4)))
        aside = TREES + rng.uniform(-0.2, 0.3)
        solids += _beside(piece, radius, way + rng.uniform(-2.5, 2.5), side, aside)
    return solids
