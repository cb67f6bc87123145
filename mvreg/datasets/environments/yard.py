"""A closed courtyard that is its own image under half a turn, but for small things: a trap."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from mvreg.datasets.environments import outdoors
from mvreg.datasets.environments.build import ball, between, box, pillar, put
from mvreg.datasets.environments.plan import Plan, Site, dense
from mvreg.datasets.environments.scene import Scene, moved
from mvreg.datasets.environments.solids import Solid
from mvreg.types import Array

#: Half a turn about the middle of the yard, without a rounding error.
HALF_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])
#: From the walls to the path of the scanner (m).
INSET = 3.2


@lru_cache(maxsize=8)
def yard(variant: int) -> Site:
    """Another yard for each number, about 15 by 11 m."""
    rng = np.random.default_rng([variant, 0x7A4D])
    half = rng.uniform([7.0, 5.2], [8.2, 6.0])
    x, y = half - INSET
    path = [(-x, -y), (x, -y), (x, y), (-x, y)]
    plan = Plan(-half, half, dense(path, closed=True))
    solids = _half(rng, plan)
    solids += moved(solids, HALF_TURN)
    solids += _middle(rng)
    solids.append(between((-30, -30, -0.3), (30, 30, 0)))
    solids += _small_things(rng, plan)
    return Site(Scene(tuple(solids)), np.array(path), closed=True)


def _half(rng: np.random.Generator, plan: Plan) -> list[Solid]:
    """The houses in the south and in the east, and what stands before them."""
    width, depth = plan.upper
    solids = put(outdoors.facade(rng, 2 * width, int(rng.integers(2, 4))), 0, -depth)
    solids += put(outdoors.facade(rng, 2 * depth, int(rng.integers(2, 4))), width, 0, turn=90)
    for piece, size in (
        (outdoors.bins(rng, 3), (2.2, 0.8)),
        (outdoors.bench(), (1.9, 0.6)),
        (outdoors.planter(rng, 2.4), (2.5, 0.8)),
        (_rack(rng), (2.4, 1.0)),
        (outdoors.tree(rng, rng.uniform(4.0, 5.5)), (1.0, 1.0)),
    ):
        solids += _pair(rng, plan, piece, np.array(size))
    return solids


def _pair(rng: np.random.Generator, plan: Plan, piece: list[Solid], size: Array) -> list[Solid]:
    """One of a pair of things along the walls; the place of the other is taken as well."""
    for _ in range(60):
        south = rng.random() < 0.5
        centre = rng.uniform(-plan.upper + 1.2, plan.upper - 1.2)
        gap = 0.75 + size[1] / 2
        centre = np.where([not south, south], [plan.upper[0] - gap, -plan.upper[1] + gap], centre)
        extent = size if south else size[::-1]
        if plan.take(centre, extent, 0.2):
            plan.taken.append((-centre - extent / 2, -centre + extent / 2))
            return put(piece, centre[0], centre[1], turn=0 if south else 90)
    return []


def _rack(rng: np.random.Generator) -> list[Solid]:
    """A rack for bicycles: hoops, and a roof on posts."""
    solids: list[Solid] = [box((2.4, 1.0, 0.06), (0, 0, 2.0), tilt=8)]
    solids += [pillar(0.05, 2.0, (x, -0.4, 0)) for x in (-1.1, 1.1)]
    for x in np.linspace(-0.9, 0.9, 5) + rng.uniform(-0.08, 0.08, 5):
        solids.append(box((0.05, 0.8, 0.75), (x, 0, 0), rng.uniform(-10, 10)))
    return solids


def _middle(rng: np.random.Generator) -> list[Solid]:
    """A well in the middle."""
    radius = rng.uniform(0.8, 1.1)
    return [
        pillar(radius + 0.3, 0.12, (0, 0, 0)), pillar(radius, 0.65, (0, 0, 0)),
        pillar(0.2, 1.3, (0, 0, 0)), ball((0.45, 0.45, 0.16), (0, 0, 1.35)),
    ]  # fmt: skip


def _small_things(rng: np.random.Generator, plan: Plan) -> list[Solid]:
    """What tells one half of the yard from the other: a bucket, a ball, boxes."""
    solids: list[Solid] = []
    pieces: list[list[Solid]] = [
        [pillar(0.16, 0.32, (0, 0, 0))], [ball((0.14, 0.14, 0.14), (0, 0, 0.14))],
        [box((0.5, 0.35, 0.3), (0, 0, 0)), box((0.35, 0.3, 0.25), (0.03, 0, 0.3), 20)],
        [box((0.3, 0.25, 0.5), (0, 0, 0), 15)],
    ]  # fmt: skip
    for piece in pieces:
        solids += plan.anywhere(rng, piece, 0.5, 0.4)
    return solids
