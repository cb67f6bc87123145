"""Furniture, each piece in a frame of its own: x along its front, its back at y = 0, z up."""

from __future__ import annotations

import numpy as np

from mvreg.datasets.environments.build import at, ball, between, box, pillar, put, tube
from mvreg.datasets.environments.scene import moved
from mvreg.datasets.environments.solids import Solid

# Backs stand against a wall, so that the piece is at y < 0 and its front looks to -y.


def shelf(rng: np.random.Generator, width: float, height: float) -> list[Solid]:
    """A bookcase 0.32 deep with rows of books, some places empty."""
    parts: list[Solid] = [
        between((-width / 2, -0.02, 0), (width / 2, 0, height)),
        *(box((0.03, 0.32, height), (side * (width / 2 - 0.015), -0.16, 0)) for side in (-1, 1)),
    ]
    for bottom in np.arange(0.08, height - 0.2, rng.uniform(0.34, 0.42)):
        parts.append(box((width, 0.32, 0.03), (0, -0.16, bottom)))
        left = -width / 2 + 0.05
        while left < width / 2 - 0.3:
            books = rng.uniform(0.12, 0.5)
            books = min(books, width / 2 - 0.05 - left)
            tall, deep = rng.uniform(0.18, 0.29), rng.uniform(0.14, 0.26)
            if rng.random() < 0.75:
                parts.append(
                    between((left, -deep - 0.02, bottom), (left + books, 0, bottom + tall))
                )
            left += books + 0.02
    return parts


def cupboard(rng: np.random.Generator, width: float, height: float) -> list[Solid]:
    """A closed cupboard 0.5 deep, with doors and something on top of it."""
    parts: list[Solid] = [between((-width / 2, -0.5, 0), (width / 2, 0, height))]
    doors = max(round(width / 0.5), 1)
    for door in range(doors):
        x = -width / 2 + width * (door + 0.5) / doors
        parts.append(box((width / doors - 0.03, 0.025, height - 0.12), (x, -0.51, 0.08)))
        parts.append(pillar(0.015, 0.2, (x + width / doors * 0.35, -0.55, height * 0.5)))
    for _ in range(rng.integers(1, 3)):
        size = rng.uniform([0.2, 0.15, 0.1], [0.45, 0.35, 0.3])
        x = rng.uniform(-0.3, 0.3) * width
        parts.append(box(size.tolist(), (x, -0.25, height), rng.uniform(-30, 30)))
    return parts


def sofa(rng: np.random.Generator, width: float) -> list[Solid]:
    """A sofa 0.85 deep with cushions."""
    parts: list[Solid] = [
        between((-width / 2, -0.85, 0.08), (width / 2, 0, 0.42)),
        box((width, 0.18, 0.5), (0, -0.13, 0.38), tilt=12),
        *(box((0.18, 0.85, 0.6), (side * (width / 2 - 0.09), -0.425, 0.05)) for side in (-1, 1)),
    ]
    for x in rng.uniform(-0.3, 0.3, size=2) * width:
        parts.append(ball((0.24, 0.1, 0.2), (x, -0.35, 0.58), rng.uniform(-25, 25)))
    return parts


def table(rng: np.random.Generator, width: float, depth: float) -> list[Solid]:
    """A table about the origin, with a bowl, a bottle and a few boxes on it."""
    parts: list[Solid] = [box((width, depth, 0.04), (0, 0, 0.71))]
    for x in (-1, 1):
        for y in (-1, 1):
            foot = (x * (width / 2 - 0.07), y * (depth / 2 - 0.07), 0)
            parts.append(box((0.06, 0.06, 0.71), foot))
    parts.append(ball((0.16, 0.16, 0.07), (*rng.uniform(-0.2, 0.2, 2) * [width, depth], 0.8)))
    x, y = rng.uniform(-0.35, 0.35, 2) * [width, depth]
    parts.append(pillar(0.04, 0.28, (x, y, 0.75)))
    x, y = rng.uniform(-0.3, 0.3, 2) * [width, depth]
    return [*parts, box((0.3, 0.22, 0.09), (x, y, 0.75), rng.uniform(0, 180))]


def chair() -> list[Solid]:
    """A chair about the origin that looks to -y."""
    legs = [box((0.04, 0.04, 0.44), (x, y, 0)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
    return [*legs, box((0.45, 0.45, 0.05), (0, 0, 0.43)), box((0.43, 0.04, 0.5), (0, 0.22, 0.46))]


def office_chair() -> list[Solid]:
    """A chair on castors about the origin that looks to -y."""
    feet = [tube((0, 0, 0.1), (0.3 * np.cos(a), 0.3 * np.sin(a), 0.06), 0.03)
            for a in np.arange(5) * 2 * np.pi / 5]  # fmt: skip
    arms = [box((0.06, 0.3, 0.04), (side * 0.29, 0, 0.66)) for side in (-1, 1)]
    return [
        *feet, *arms, pillar(0.035, 0.4, (0, 0, 0.06)), ball((0.26, 0.25, 0.06), (0, 0, 0.48)),
        box((0.42, 0.07, 0.6), (0, 0.24, 0.56), tilt=8), *(tube((x, 0, 0.47), (x, 0, 0.67), 0.02)
        for x in (-0.29, 0.29)),
    ]  # fmt: skip


def monitor(width: float) -> list[Solid]:
    """A screen on its stand, about the origin; the picture looks to -y."""
    height = width * 0.58
    return [
        box((width, 0.035, height), (0, 0, 0.13), tilt=-6), pillar(0.025, 0.25, (0, 0.05, 0)),
        box((0.26, 0.2, 0.015), (0, 0.04, 0)), box((width / 2, 0.05, height / 2), (0, 0.04, 0.22)),
    ]  # fmt: skip


def workplace(rng: np.random.Generator, width: float) -> list[Solid]:
    """A desk 0.75 deep with its back at y = 0, a screen, papers, and a chair before it."""
    parts: list[Solid] = [
        between((-width / 2, -0.75, 0.7), (width / 2, 0, 0.74)),
        *(box((0.05, 0.7, 0.7), (side * (width / 2 - 0.05), -0.37, 0)) for side in (-1, 1)),
        box((0.4, 0.6, 0.55), (rng.choice([-1, 1]) * (width / 2 - 0.3), -0.35, 0.1)),
    ]
    parts += put(monitor(rng.uniform(0.45, 0.7)), rng.uniform(-0.2, 0.2), -0.25, 0.74,
                 rng.uniform(-20, 20))  # fmt: skip
    for _ in range(4):
        size = rng.uniform([0.15, 0.1, 0.03], [0.3, 0.25, 0.18])
        x, y = rng.uniform(-0.42, 0.42) * width, rng.uniform(-0.65, -0.15)
        parts.append(box(size.tolist(), (x, y, 0.74), rng.uniform(0, 180)))
    return parts + put(office_chair(), rng.uniform(-0.3, 0.3), -0.95, turn=rng.uniform(110, 250))


def radiator(width: float) -> list[Solid]:
    """A radiator with ribs, 0.6 high, its back at y = 0."""
    ribs = [box((0.05, 0.1, 0.55), (x, -0.09, 0.12))
            for x in np.linspace(-width / 2, width / 2, max(round(width / 0.12), 2))]  # fmt: skip
    return [between((-width / 2, -0.08, 0.14), (width / 2, -0.03, 0.65)), *ribs]


def plant(rng: np.random.Generator) -> list[Solid]:
    """A plant in a pot, about the origin."""
    leaves: list[Solid] = []
    for _ in range(7):
        radii = rng.uniform([0.06, 0.12, 0.05], [0.12, 0.24, 0.12])
        centre = rng.uniform([-0.2, -0.2, 0.6], [0.2, 0.2, 1.3])
        leaves.append(ball(radii.tolist(), centre.tolist(), rng.uniform(0, 180)))
    return [pillar(0.18, 0.35, (0, 0, 0)), tube((0, 0, 0.3), (0.05, 0, 1.1), 0.025), *leaves]


def floor_lamp() -> list[Solid]:
    """A lamp that stands on the floor, about the origin."""
    return [pillar(0.15, 0.03, (0, 0, 0)), pillar(0.015, 1.5, (0, 0, 0)),
            pillar(0.2, 0.25, (0, 0, 1.45))]  # fmt: skip


def picture(rng: np.random.Generator) -> list[Solid]:
    """A picture, or a board, on the wall at y = 0."""
    width, height = rng.uniform([0.4, 0.3], [1.2, 0.8])
    frame = box((width, 0.03, height), (0, -0.015, rng.uniform(1.2, 1.5)))
    return [frame, *moved([box((width * 0.8, 0.02, height * 0.8), (0, -0.03, 0))],
                          at(0, 0, float(frame.pose[2, 3]) - height * 0.4))]  # fmt: skip
