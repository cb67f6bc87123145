"""A living room: furniture along the walls, a table with chairs, windows, a chimney in a corner."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mvreg.datasets.environments import furniture
from mvreg.datasets.environments.build import between, box, pillar, put, wall
from mvreg.datasets.environments.plan import SIDES, Plan, Site, dense
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.environments.solids import Solid
from mvreg.types import Array

#: From the walls to the path of the scanner (m).
INSET = 1.35


@lru_cache(maxsize=8)
def room(variant: int) -> Site:
    """Another room for each number, about 7 by 6 m."""
    rng = np.random.default_rng([variant, 0x400])
    size = rng.uniform([6.4, 5.4], [7.6, 6.4])
    height = float(rng.uniform(2.5, 2.8))
    width, depth = size
    path = [(INSET, INSET), (width - INSET, INSET), (width - INSET, depth - INSET),
            (INSET, depth - INSET)]  # fmt: skip
    plan = Plan(np.zeros(2), size, dense(path, closed=True))
    solids = shell(np.zeros(2), size, height)
    solids += _walls(plan, rng, height)
    solids += _table(plan, rng)
    solids += _furniture(plan, rng)
    solids += _ceiling(rng, size, height)
    return Site(Scene(tuple(solids)), np.array(path), closed=True)


def shell(lower: Array, upper: Array, height: float) -> list[Solid]:
    """Floor and ceiling."""
    low, high = lower - 1, upper + 1
    return [
        between((*low, -0.2), (*high, 0)),
        between((*low, height), (*high, height + 0.2)),
    ]


def _walls(plan: Plan, rng: np.random.Generator, height: float) -> list[Solid]:
    """Four walls: two windows with radiators, a door, a window elsewhere, a chimney."""
    width, depth = plan.upper
    first, second = rng.uniform(0.08, 0.18) * width, rng.uniform(0.5, 0.6) * width
    left = float(rng.uniform(0.1, 0.6) * depth)
    door = float(rng.uniform(0.1, 0.7) * width)
    wide = float(rng.uniform(1.2, 1.6))
    solids = [
        *wall((0, depth), (width, depth), height, [(first, first + wide, 0.85, 2.2),
              (second, second + wide + 0.4, 0.85, 2.2)], 0.32),
        *wall((width, depth), (width, 0), height, [(left, left + 1.0, 1.0, 2.1)], 0.28),
        *wall((width, 0), (0, 0), height, [(door, door + 0.95, 0.001, 2.05)], 0.18),
        *wall((0, 0), (0, depth), height),
    ]  # fmt: skip
    for centre, length in ((first + wide / 2, wide - 0.2), (second + wide / 2 + 0.2, wide)):
        if plan.take(np.array([centre, depth - 0.075]), np.array([length, 0.15])):
            solids += put(furniture.radiator(length - 0.1), centre, depth)
    plan.take(np.array([width - door - 0.475, 0.35]), np.array([0.95, 0.7]))
    chimney = rng.uniform(0.4, 0.6, size=2)
    if plan.take(chimney / 2, chimney):
        solids.append(between((0, 0, 0), (*chimney, height)))
    return solids


def _table(plan: Plan, rng: np.random.Generator) -> list[Solid]:
    """A table near the middle of the room, with chairs around it, none quite straight."""
    width, depth = rng.uniform([1.2, 0.8], [1.6, 0.95])
    centre = (plan.lower + plan.upper) / 2 + rng.uniform(-0.15, 0.15, 2)
    turn = float(rng.uniform(-12, 12))
    parts = furniture.table(rng, width, depth)
    for x, y, facing in ((-0.3, 1, 0), (0.3, 1, 0), (0, -1, 180), (0.62, 0, -90)):
        if rng.random() < 0.85:
            out = depth / 2 + rng.uniform(-0.02, 0.12)
            parts += put(furniture.chair(), x * width + (0.1 if y == 0 else 0), y * out,
                         turn=facing + rng.uniform(-20, 20))  # fmt: skip
    plan.taken.append((centre - 1.0, centre + 1.0))
    return put(parts, centre[0], centre[1], turn=turn)


def _furniture(plan: Plan, rng: np.random.Generator) -> list[Solid]:
    """What stands along the walls, the largest pieces first."""
    solids: list[Solid] = []
    wide = float(rng.uniform(1.6, 2.2))
    solids += plan.along_wall(rng, furniture.sofa(rng, wide), wide, 0.85)
    for _ in range(3):
        wide, tall = rng.uniform([0.9, 1.5], [1.6, 2.2])
        solids += plan.along_wall(rng, furniture.shelf(rng, wide, tall), wide, 0.34)
        wide, tall = rng.uniform([0.8, 0.7], [1.4, 2.0])
        solids += plan.along_wall(rng, furniture.cupboard(rng, wide, tall), wide, 0.55)
    boxed = put(furniture.plant(rng), 0, -0.3)
    solids += plan.along_wall(rng, boxed, 0.6, 0.6)
    solids += plan.along_wall(rng, put(furniture.floor_lamp(), 0, -0.22), 0.44, 0.44)
    solids += plan.along_wall(rng, [box((0.4, 0.35, 0.5), (0, -0.2, 0))], 0.5, 0.4)
    solids += plan.anywhere(rng, furniture.chair(), 0.45, 0.5)
    return solids + pictures(plan, rng, 5)


def pictures(plan: Plan, rng: np.random.Generator, count: int) -> list[Solid]:
    """Pictures and boards on the walls, `count` at most, some behind other things."""
    solids: list[Solid] = []
    for _ in range(count):
        turn = SIDES[rng.integers(4)]
        place = rng.uniform(plan.lower + 0.7, plan.upper - 0.7)
        x = {-90.0: plan.upper[0], 90.0: plan.lower[0]}.get(turn, place[0])
        y = {0.0: plan.upper[1], 180.0: plan.lower[1]}.get(turn, place[1])
        if np.linalg.norm(plan.path - (x, y), axis=1).min() > 1.15:  # else it may bar a door
            solids += put(furniture.picture(rng), x, y, turn=turn)
    return solids


def _ceiling(rng: np.random.Generator, size: Array, height: float) -> list[Solid]:
    """A lamp that hangs, and a beam across the ceiling."""
    lamp, beam = rng.uniform(0.4, 0.6, size=2) * size, rng.uniform(0.2, 0.35) * size[0]
    return [
        pillar(0.02, 0.5, (*lamp, height - 0.5)),
        pillar(0.22, 0.18, (*lamp, height - 0.6)),
        between((beam, 0, height - 0.18), (beam + 0.2, size[1], height)),
    ]
