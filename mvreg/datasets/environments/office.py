"""An office floor: three rooms and a corridor, joined by open doors."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mvreg.datasets.environments import furniture
from mvreg.datasets.environments.build import between, box, pillar, put, tube, wall
from mvreg.datasets.environments.plan import Plan, Site, dense
from mvreg.datasets.environments.room import pictures, shell
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.environments.solids import Solid
from mvreg.types import Array

HEIGHT = 2.7
#: Thickness of the walls inside, and width of the doors (m).
INNER, DOOR = 0.14, 1.0
Windows = list[tuple[float, float, float, float]]


@lru_cache(maxsize=8)
def office(variant: int) -> Site:
    """Another office for each number: two rooms north of the corridor, one to the south.

    The corridor is along x, from the origin, with its southern wall at y = 0.
    """
    rng = np.random.default_rng([variant, 0x0FF1])
    length, width = rng.uniform(11, 12.5), rng.uniform(2.3, 2.6)
    split = length * rng.uniform(0.42, 0.52)
    north, south = rng.uniform(4.0, 4.5), rng.uniform(4.2, 4.8)
    west_of_south = rng.uniform(2.5, 3.5)
    rooms = [
        (np.array([0, width + INNER]), np.array([split, width + INNER + north])),
        (np.array([split + INNER, width + INNER]), np.array([length, width + INNER + north])),
        (np.array([west_of_south, -INNER - south]), np.array([west_of_south + 6.0, -INNER])),
    ]
    shares = rng.uniform([0.3, 0.45, 0.3], [0.5, 0.65, 0.65])
    doors = [float(low[0] + share * (high[0] - low[0]))
             for (low, high), share in zip(rooms, shares, strict=True)]  # fmt: skip
    path = _path(rooms, doors, width)
    kept_free = dense(path, closed=False)
    solids = shell(np.array([0, -INNER - south]), rooms[1][1], HEIGHT)
    for (low, high), door, facing in zip(rooms, doors, (1, 1, -1), strict=True):
        solids += _room(rng, Plan(low, high, kept_free), door, facing)
    solids += _corridor(rng, Plan(np.zeros(2), np.array([length, width]), kept_free), doors)
    return Site(Scene(tuple(solids)), np.array(path))


def _path(
    rooms: list[tuple[Array, Array]], doors: list[float], width: float
) -> list[tuple[float, float]]:
    """From the first room to the southern one, and on to the last, through the doors."""
    middles = [(low + high) / 2 for low, high in rooms]
    centre = width / 2
    first, last, south = ((float(m[0]), float(m[1])) for m in (middles[0], middles[1], middles[2]))
    beside = (doors[2], south[1])
    return [
        (first[0] - 0.8, first[1] + 0.5), (doors[0], first[1] - 0.5), (doors[0], centre),
        (doors[2], centre), beside, (south[0] + 0.9, south[1] - 0.4), beside, (doors[2], centre),
        (doors[1], centre), (doors[1], last[1] - 0.4), (last[0] + 0.9, last[1] + 0.5),
    ]  # fmt: skip


def _room(rng: np.random.Generator, plan: Plan, door: float, facing: int) -> list[Solid]:
    """A room with its door to the corridor, its windows opposite; `facing` is 1 to the north."""
    low, high = plan.lower, plan.upper
    width = high[0] - low[0]
    near, far = (low[1], high[1]) if facing > 0 else (high[1], low[1])
    left, right = (low[0], high[0]) if facing > 0 else (high[0], low[0])
    windows: Windows = []
    edge = float(rng.uniform(0.3, 0.7))
    while edge + 1.5 < width:
        wide = float(rng.uniform(1.0, 1.5))
        windows.append((edge, edge + wide, 0.9, 2.3))
        edge += wide + float(rng.uniform(0.3, 0.8))
    solids = wall((left, far), (right, far), HEIGHT, windows, 0.3)
    for first, last, _, _ in windows[::2]:
        x = left + facing * (first + last) / 2
        plan.take(np.array([x, far - facing * 0.075]), np.array([1.0, 0.15]))
        solids += put(furniture.radiator(0.9), x, far, turn=0 if facing > 0 else 180)
    solids += wall((right, far), (right, near), HEIGHT, thickness=INNER)
    solids += wall((left, near), (left, far), HEIGHT, thickness=INNER)
    start = abs(right - door) - DOOR / 2
    solids += wall((right, near), (left, near), HEIGHT, [(start, start + DOOR, 0, 2.1)], INNER)
    hinge = door - facing * DOOR / 2
    solids.append(between((hinge - 0.045, min(near, near + facing * 0.95), 0.01),
                          (hinge, max(near, near + facing * 0.95), 2.05)))  # fmt: skip
    plan.take(np.array([hinge - 0.02, near + facing * 0.5]), np.array([0.05, 1.0]))
    return [*solids, *_duct(rng, plan), *_equipment(rng, plan),
            *_lamps(rng, low, high, int(rng.integers(2, 4)))]  # fmt: skip


def _duct(rng: np.random.Generator, plan: Plan) -> list[Solid]:
    """A beam and a duct below the ceiling of a room, across each other."""
    (x, y), deep = rng.uniform(0.15, 0.85, 2) * (plan.upper - plan.lower), rng.uniform(0.2, 0.35)
    left, front = plan.lower
    right, back = plan.upper
    return [
        between((left + x - 0.15, front, HEIGHT - deep), (left + x + 0.15, back, HEIGHT)),
        tube((left, front + y, HEIGHT - 0.25), (right, front + y, HEIGHT - 0.25), 0.16),
    ]


def _equipment(rng: np.random.Generator, plan: Plan) -> list[Solid]:
    """What an office has along its walls, the largest first, and in its middle."""
    solids: list[Solid] = []
    column = rng.uniform([0.35, 0.3], [0.6, 0.5])
    solids += plan.along_wall(rng, [box((*column, HEIGHT), (0, -column[1] / 2, 0))], *column)
    for _ in range(2):
        wide = float(rng.uniform(1.4, 1.8))
        solids += plan.along_wall(rng, furniture.workplace(rng, wide), wide, 1.3)
    for _ in range(2):
        wide, tall = rng.uniform([0.8, 1.2], [1.5, 2.1])
        solids += plan.along_wall(rng, furniture.shelf(rng, wide, tall), wide, 0.34)
        wide, tall = rng.uniform([0.7, 0.7], [1.2, 1.9])
        solids += plan.along_wall(rng, furniture.cupboard(rng, wide, tall), wide, 0.55)
    solids += plan.along_wall(rng, put(furniture.plant(rng), 0, -0.32), 0.6, 0.62)
    wide = float(rng.uniform(1.2, 1.8))
    solids += plan.anywhere(rng, furniture.table(rng, wide, 0.8), wide, 0.8, turns=False)
    solids += plan.anywhere(rng, furniture.office_chair(), 0.6, 0.6)
    solids += plan.anywhere(rng, [pillar(0.15, 0.35, (0, 0, 0))], 0.3, 0.3)
    return solids + pictures(plan, rng, 3)


def _corridor(rng: np.random.Generator, plan: Plan, doors: list[float]) -> list[Solid]:
    """What is in the corridor, and its walls at the south and at both ends."""
    length, width = plan.upper
    start = length - doors[2] - DOOR / 2
    solids = [
        *wall((length, 0), (0, 0), HEIGHT, [(start, start + DOOR, 0, 2.1)], INNER - 0.01),
        *wall((0, 0), (0, width), HEIGHT, [(0.5, width - 0.4, 0.9, 2.2)]),
        *wall((length, width), (length, 0), HEIGHT, [(0.45, width - 0.45, 0.001, 2.1)]),
        *wall((0, width), (length, width), HEIGHT, [
            (doors[0] - DOOR / 2, doors[0] + DOOR / 2, 0, 2.1),
            (doors[1] - DOOR / 2, doors[1] + DOOR / 2, 0, 2.1)], INNER - 0.01),
    ]  # fmt: skip
    for wide, tall in rng.uniform([0.7, 1.0], [1.3, 2.0], (3, 2)):
        solids += plan.along_wall(rng, furniture.cupboard(rng, wide, tall), wide, 0.55)
        solids += plan.along_wall(rng, furniture.shelf(rng, wide, tall), wide, 0.34)
        column = rng.uniform([0.3, 0.15], [0.5, 0.4])
        solids += plan.along_wall(rng, [box((*column, HEIGHT), (0, -column[1] / 2, 0))], *column)
    lid = box((0.55, 0.45, 0.12), (0, -0.25, 1.0), tilt=6)
    solids += plan.along_wall(rng, [box((0.6, 0.5, 1.0), (0, -0.25, 0)), lid], 0.6, 0.5)
    solids += plan.along_wall(rng, put(furniture.plant(rng), 0, -0.3), 0.5, 0.5)
    for x in rng.uniform(0.5, length - 0.5, size=2):
        if abs(x - doors[2]) > DOOR:
            solids.append(pillar(0.08, 0.5, (x, 0.09, 0.9)))
    solids += pictures(plan, rng, 6)
    return [*solids, *_duct(rng, plan), *_lamps(rng, plan.lower, plan.upper, 3)]


def _lamps(rng: np.random.Generator, low: Array, high: Array, count: int) -> list[Solid]:
    """Lamps below the ceiling, in a row."""
    y = float((low[1] + high[1]) / 2 + rng.uniform(-0.2, 0.2))
    places = np.linspace(low[0], high[0], count + 2)[1:-1] + rng.uniform(-0.2, 0.2, count)
    return [box((1.0, 0.2, 0.1), (x, y, HEIGHT - 0.12)) for x in places]
