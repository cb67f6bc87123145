"""A desk with what lies on it, and a chair before it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mvreg.datasets.environments import furniture
from mvreg.datasets.environments.build import ball, between, box, pillar, put, tube
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.environments.solids import Solid
from mvreg.datasets.viewpoints import orbit
from mvreg.types import Array

#: Height of the top of the desk (m).
TOP = 0.74
#: What a camera looks at (m).
TARGET = np.array([0.0, -0.1, 0.75])


@lru_cache(maxsize=8)
def desk(variant: int) -> Scene:
    """Another desk for each number, about 1.6 by 0.8 m, its middle above the origin."""
    rng = np.random.default_rng([variant, 0xDE5C])
    width, depth = rng.uniform([1.5, 0.75], [1.8, 0.85])
    solids: list[Solid] = [between((-3, -3, -0.1), (3, 3, 0))]
    solids += _desk(rng, width, depth)
    solids += _things(rng, width, depth)
    solids += put(furniture.office_chair(), rng.uniform(-0.4, 0.4), -depth / 2 - 0.45,
                  turn=rng.uniform(130, 230))  # fmt: skip
    x = rng.choice([-1, 1]) * (width / 2 + 0.3)
    solids.append(pillar(0.15, 0.32, (x, rng.uniform(-0.3, 0.2), 0)))
    solids += put(furniture.plant(rng), -0.5 * x * rng.uniform(0.8, 1.2), rng.uniform(0.75, 0.85))
    solids.append(box((1.6, 1.1, 0.015), (rng.uniform(-0.5, 0.5), -0.8, 0), rng.uniform(-15, 15)))
    return Scene(tuple(solids))


def _desk(rng: np.random.Generator, width: float, depth: float) -> list[Solid]:
    side = int(rng.choice([-1, 1]))
    drawers = width / 2 - 0.24
    solids: list[Solid] = [
        box((width, depth, 0.03), (0, 0, TOP - 0.03)),
        box((0.42, depth - 0.15, 0.62), (side * drawers, 0, TOP - 0.67)),
        box((0.22, 0.5, 0.45), (-side * (width / 2 - 0.25), 0.05, 0)),
    ]
    for level in (0.12, 0.32, 0.52):
        solids.append(box((0.38, 0.03, 0.17), (side * drawers, -depth / 2 + 0.06, level)))
    for x in (-1, 1):
        for y in (-1, 1):
            foot = (x * (width / 2 - 0.05), y * (depth / 2 - 0.05), 0)
            solids.append(box((0.05, 0.05, TOP - 0.03), foot))
    return solids


def _things(rng: np.random.Generator, width: float, depth: float) -> list[Solid]:
    """What lies on the desk, each thing near a place of its own, from the left to the right."""
    slots = rng.permutation(4)
    pieces = [_books, _boxes, _lamp, _mugs]
    solids = put(furniture.monitor(rng.uniform(0.5, 0.62)), rng.uniform(-0.1, 0.1), depth * 0.2,
                 TOP, rng.uniform(-15, 15))  # fmt: skip
    keyboard = rng.uniform(-0.1, 0.1)
    solids.append(box((0.42, 0.14, 0.025), (keyboard, -depth * 0.28, TOP), rng.uniform(-8, 8)))
    solids.append(ball((0.035, 0.055, 0.03), (keyboard + 0.3, -depth * 0.28, TOP + 0.01)))
    solids.append(box((0.21, 0.29, 0.012), (-0.42, -depth * 0.25, TOP), rng.uniform(-40, 40)))
    places = [(-0.36, 0.28), (0.36, 0.26), (-0.36, -0.22), (0.36, -0.24)]
    for slot, piece in zip(slots, pieces, strict=True):
        x, y = places[slot]
        solids += put(piece(rng), x * width, y * depth, TOP, rng.uniform(-25, 25))
    return solids


def _books(rng: np.random.Generator) -> list[Solid]:
    """A pile of books, none straight, with one that leans on it."""
    solids: list[Solid] = []
    height = 0.0
    for _ in range(rng.integers(4, 7)):
        size = rng.uniform([0.15, 0.2, 0.02], [0.2, 0.27, 0.05])
        place = rng.uniform(-0.015, 0.015, 2)
        solids.append(box(size.tolist(), (*place, height), rng.uniform(-20, 20)))
        height += size[2]
    return [*solids, box((0.16, 0.03, 0.23), (0, 0.17, 0.0), tilt=-12)]


def _boxes(rng: np.random.Generator) -> list[Solid]:
    """Two cartons and a tin."""
    size = rng.uniform([0.2, 0.15, 0.12], [0.28, 0.22, 0.2])
    return [box(size.tolist(), (0, 0, 0)), box((0.12, 0.1, 0.08), (0.02, 0, size[2]), 30),
            pillar(0.05, 0.12, (-size[0] / 2 - 0.08, 0.02, 0))]  # fmt: skip


def _lamp(rng: np.random.Generator) -> list[Solid]:
    """A lamp with a jointed arm."""
    elbow, head = (0.12, 0.06, 0.38), (-0.08, -0.12, rng.uniform(0.42, 0.52))
    return [pillar(0.09, 0.03, (0, 0, 0)), tube((0, 0, 0.02), elbow, 0.012),
            tube(elbow, head, 0.012), ball((0.09, 0.09, 0.06), head)]  # fmt: skip


def _mugs(rng: np.random.Generator) -> list[Solid]:
    """Two mugs with handles, a bottle, and a cup of pens."""
    solids: list[Solid] = []
    for x, y in ((-0.08, 0.0), (0.07, rng.uniform(-0.08, 0.08))):
        handle = box((0.03, 0.012, 0.06), (0.05, 0, 0.02))
        solids += put([pillar(0.04, 0.095, (0, 0, 0)), handle], x, y, turn=rng.uniform(0, 360))
    solids += [pillar(0.035, 0.2, (0.0, 0.13, 0)), pillar(0.014, 0.28, (0.0, 0.13, 0))]
    solids.append(pillar(0.04, 0.1, (0.15, 0.12, 0)))
    pens = rng.uniform(-0.05, 0.05, (4, 2))
    solids += [tube((0.15, 0.12, 0.08), (0.15 + x, 0.12 + y, 0.19), 0.005) for x, y in pens]
    return solids


def around(count: int, rng: np.random.Generator) -> list[Array]:
    """Poses ``T_world_scan`` of a camera held by hand, around the desk in steps of 30 degrees."""
    step = min(30.0, 360 / count)
    poses = []
    for index in range(count):
        turn, rise, roll, out = rng.uniform(-1, 1, size=4) * [4, 6, 6, 0.15]
        azimuth = (index - (count - 1) / 2) * step + turn
        aim = TARGET + rng.uniform(-0.1, 0.1, size=3)
        poses.append(orbit(aim, 1.75 + out, azimuth, 28 + rise, roll))
    return poses
