"""What stands along a street or in a yard, each in a frame of its own, z up."""

from __future__ import annotations

import numpy as np

from mvreg.datasets.environments.build import ball, between, box, pillar, prism, put, tube
from mvreg.datasets.environments.solids import Solid

#: How far windows and doors are set back (m).
RECESS = 0.22


def facade(
    rng: np.random.Generator, width: float, floors: int, depth: float = 8.0, roof: bool = True
) -> list[Solid]:
    """A house: its front in the plane y = 0 looks to +y, from -width / 2 to width / 2 along x."""
    heights = np.cumsum([0.0, rng.uniform(3.2, 3.8), *rng.uniform(2.7, 3.1, floors - 1)])
    top = float(heights[-1])
    solids: list[Solid] = [between((-width / 2, -depth, -0.1), (width / 2, -RECESS, top))]
    for floor in range(floors):
        bottom, above = float(heights[floor]), float(heights[floor + 1])
        solids += _front(rng, width, bottom, above, ground=floor == 0)
    solids.append(between((-width / 2, -0.1, top - 0.25), (width / 2, 0.3, top)))
    pipe = rng.choice([-1, 1]) * (width / 2 - 0.2)
    solids.append(pillar(0.06, top, (pipe, 0.08, 0)))
    solids += _balconies(rng, width, heights)
    if roof:
        ridge = rng.uniform(1.8, 3.2)
        gable = prism([(0.3, top), (-depth / 2, top + ridge), (-depth - 0.3, top)], width)
        solids += [gable, box((0.7, 0.7, ridge + 0.8), (rng.uniform(-0.35, 0.35) * width,
                   -rng.uniform(0.3, 0.6) * depth, top))]  # fmt: skip
    return solids


def _front(
    rng: np.random.Generator, width: float, bottom: float, top: float, ground: bool
) -> list[Solid]:
    """One floor: a band below the windows, one above them, and piers between them."""
    sill = bottom + (rng.uniform(0.5, 0.9) if ground else rng.uniform(0.7, 0.95))
    head = min(sill + rng.uniform(1.3, 1.7), top - 0.25)
    count = max(round(width / rng.uniform(1.8, 2.6)), 2)
    steps = rng.uniform(0.8, 1.25, count)
    edges = -width / 2 + width * np.concatenate([[0], np.cumsum(steps)]) / steps.sum()
    piers = rng.uniform(0.3, 0.5, count + 1)
    solids: list[Solid] = [between((-width / 2, -RECESS, head), (width / 2, 0, top))]
    for edge, half in zip(edges, piers, strict=True):
        left, right = max(edge - half, -width / 2), min(edge + half, width / 2)
        solids.append(between((left, -RECESS, sill), (right, 0, head)))
    door = rng.integers(count) if ground else -1
    start, end = -width / 2, width / 2
    if ground:
        middle = (edges[door] + edges[door + 1]) / 2
        solids.append(between((start, -RECESS, bottom), (middle - 0.55, 0.03, sill)))
        solids.append(box((1.5, 0.7, 0.17), (middle, 0.3, 0)))
        solids.append(box((1.3, 0.9, 0.08), (middle, 0.4, head + 0.1)))
        start = middle + 0.55
    solids.append(between((start, -RECESS, bottom), (end, 0.03 if ground else 0, sill)))
    return solids


def _balconies(rng: np.random.Generator, width: float, heights: np.ndarray) -> list[Solid]:
    """On some floors a balcony with its railing."""
    solids: list[Solid] = []
    for height in heights[1:-1]:
        if rng.random() < 0.55:
            x, half = rng.uniform(-0.3, 0.3) * width, rng.uniform(0.8, 1.5)
            deep = rng.uniform(0.9, 1.3)
            solids.append(between((x - half, 0, height), (x + half, deep, height + 0.15)))
            solids.append(between((x - half, deep - 0.05, height), (x + half, deep, height + 1.0)))
            solids.append(between((x - half, 0, height), (x - half + 0.05, deep, height + 1.0)))
    return solids


def tree(rng: np.random.Generator, height: float) -> list[Solid]:
    """A tree about the origin: a leaning trunk, a fork, and a crown of ellipsoids."""
    lean = rng.uniform(-0.3, 0.3, 2)
    fork = (*lean, 0.45 * height)
    solids: list[Solid] = [tube((0, 0, -0.1), fork, rng.uniform(0.12, 0.22))]
    for _ in range(rng.integers(6, 9)):
        turn, out = rng.uniform(0, 2 * np.pi), rng.uniform(0.05, 0.24) * height
        centre = (lean[0] + out * np.cos(turn), lean[1] + out * np.sin(turn),
                  rng.uniform(0.55, 0.95) * height)  # fmt: skip
        radii = rng.uniform(0.09, 0.17, 3) * height
        solids.append(ball(radii.tolist(), centre, rng.uniform(0, 180)))
        solids.append(tube(fork, centre, 0.05))
    return solids


def car(rng: np.random.Generator) -> list[Solid]:
    """A car about the origin, along x: body, cabin, wheels, mirrors; one in five is a van."""
    length, width = rng.uniform([3.8, 1.65], [4.8, 1.85])
    van = rng.random() < 0.2
    waist, top = (1.1, rng.uniform(1.9, 2.3)) if van else (0.85, rng.uniform(1.4, 1.55))
    front, back = (0.9, 0.05) if van else (1.1, rng.uniform(0.3, 0.8))
    low, high = -length / 2 + back, length / 2 - front
    cabin = prism([(low, waist), (high + 0.5, waist), (high - 0.1, top), (low + 0.25, top)],
                  width - 0.2)  # fmt: skip
    wheels: list[Solid] = []
    for x in (-0.31 * length, 0.31 * length):
        for y in (-width / 2, width / 2):
            wheels.append(tube((x, y - 0.2 * np.sign(y), 0.32), (x, y, 0.32), 0.32))
    mirrors = [box((0.12, 0.2, 0.14), (high, side * (width / 2 + 0.08), waist)) for side in (-1, 1)]
    return [box((length, width - 0.04, waist - 0.25), (0, 0, 0.25)), *put([cabin], 0, 0, turn=-90),
            *wheels, *mirrors]  # fmt: skip


def lamp_post(height: float) -> list[Solid]:
    """A street lamp about the origin, its arm along -y."""
    return [pillar(0.16, 0.5, (0, 0, 0)), pillar(0.07, height, (0, 0, 0)),
            tube((0, 0, height - 0.05), (0, -1.2, height + 0.1), 0.05),
            box((0.3, 0.6, 0.14), (0, -1.3, height + 0.05))]  # fmt: skip


def sign(rng: np.random.Generator) -> list[Solid]:
    """A traffic sign about the origin."""
    plate = box((rng.uniform(0.4, 0.7), 0.03, rng.uniform(0.4, 0.7)), (0, 0.05, 2.0),
                rng.uniform(0, 180))  # fmt: skip
    return [pillar(0.04, 2.7, (0, 0, 0)), plate]


def bench() -> list[Solid]:
    """A bench about the origin that looks to +y."""
    legs = [box((0.1, 0.4, 0.42), (x, 0, 0)) for x in (-0.7, 0.7)]
    return [*legs, box((1.8, 0.45, 0.06), (0, 0, 0.42)),
            box((1.8, 0.05, 0.4), (0, -0.22, 0.5), tilt=-10)]  # fmt: skip


def bins(rng: np.random.Generator, count: int) -> list[Solid]:
    """Dustbins in a row along x, about the origin."""
    solids: list[Solid] = []
    for index in range(count):
        x = (index - (count - 1) / 2) * 0.72
        size = rng.uniform([0.5, 0.55, 0.9], [0.62, 0.7, 1.1])
        turn = rng.uniform(-8, 8)
        solids.append(box(size.tolist(), (x, 0, 0), turn))
        solids.append(box((size[0] + 0.05, size[1] + 0.05, 0.07), (x, 0, size[2]), turn, tilt=5))
    return solids


def planter(rng: np.random.Generator, width: float) -> list[Solid]:
    """A trough with shrubs, about the origin."""
    shrubs: list[Solid] = []
    for x in np.arange(-width / 2 + 0.25, width / 2 - 0.1, 0.45):
        radii = rng.uniform([0.2, 0.2, 0.2], [0.35, 0.35, 0.5])
        shrubs.append(ball(radii.tolist(), (x, rng.uniform(-0.1, 0.1), 0.6), rng.uniform(0, 180)))
    return [box((width, 0.6, 0.5), (0, 0, 0)), *shrubs]
