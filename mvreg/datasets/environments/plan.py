"""Ground plans: where furniture stands, and where a tripod may."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mvreg.datasets.environments.build import at, put
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.environments.solids import Solid
from mvreg.types import Array

#: Furniture keeps so far away from the path of the instrument (m).
PASSAGE = 0.5
#: Clearance around the axis of a tripod (m).
TRIPOD = 0.33
#: Turn (degrees) of furniture along the wall on the side of +y, +x, -y, -x.
SIDES = (0.0, -90.0, 180.0, 90.0)


@dataclass
class Plan:
    """Places in a rectangle of the floor that are taken.

    Parameters
    ----------
    lower, upper : (2,) arrays
        Corners of the rectangle.
    path : (K, 2) array
        Points that are kept free.
    taken : list
        Corners, (2,) and (2,), of the places that are taken.
    """

    lower: Array
    upper: Array
    path: Array
    taken: list[tuple[Array, Array]] = field(default_factory=list)

    def take(self, centre: Array, size: Array, margin: float = 0.0) -> bool:
        """Take the place of `size` (2,) about `centre` (2,), if it is free; say whether it was."""
        low, high = centre - size / 2, centre + size / 2
        inside = bool((low >= self.lower - 1e-9).all() and (high <= self.upper + 1e-9).all())
        gaps = np.maximum(np.maximum(low - self.path, self.path - high), 0)
        free = all(
            (low >= other_high + margin).any() or (high <= other_low - margin).any()
            for other_low, other_high in self.taken
        )
        if inside and free and (np.linalg.norm(gaps, axis=1) >= PASSAGE).all():
            self.taken.append((low, high))
            return True
        return False

    def along_wall(self, rng: np.random.Generator, piece: list[Solid], width: float,
                   depth: float) -> list[Solid]:  # fmt: skip
        """The piece with its back to a wall, anywhere; nothing if no place is free."""
        for _ in range(80):
            turn = SIDES[rng.integers(4)]
            centre = rng.uniform(self.lower, self.upper)
            size = np.array([width, depth] if turn in (0.0, 180.0) else [depth, width])
            outwards = _outwards(turn)
            wall = np.where(outwards > 0, self.upper, self.lower)
            centre = np.where(outwards != 0, wall - outwards * depth / 2, centre)
            if self.take(centre, size, 0.04):
                back = centre + outwards * depth / 2
                return put(piece, back[0], back[1], turn=turn)
        return []

    def anywhere(self, rng: np.random.Generator, piece: list[Solid], width: float, depth: float,
                 turns: bool = True) -> list[Solid]:  # fmt: skip
        """The piece, built about the origin, at any free place; nothing if there is none."""
        across = float(np.hypot(width, depth)) if turns else max(width, depth)
        for _ in range(80):
            centre = rng.uniform(self.lower + across / 2, self.upper - across / 2)
            turn = float(rng.uniform(0, 360)) if turns else 0.0
            if self.take(centre, np.full(2, across), 0.1):
                return put(piece, centre[0], centre[1], turn=turn)
        return []


def _outwards(turn: float) -> Array:
    """Unit vector (2,) towards the wall of pieces turned so, along an axis exactly."""
    return {0.0: np.array([0.0, 1]), -90.0: np.array([1.0, 0]), 180.0: np.array([0.0, -1]),
            90.0: np.array([-1.0, 0])}[turn]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Site:
    """A scene, and the path along which its stations are.

    Parameters
    ----------
    scene : Scene
    path : (K, 2) array
        Corners of the path.
    closed : bool
        Whether the last corner leads to the first again.
    """

    scene: Scene
    path: Array
    closed: bool = False

    def tripods(self, count: int, rng: np.random.Generator) -> list[Array]:
        """Poses ``T_world_scan`` of a levelled scanner, 1.5 to 1.7 m high, near the path.

        They are about equally spaced along the path, turned at random, and clear of all solids.
        """
        poses = []
        for place in along(self.path, count, self.closed):
            height = rng.uniform(1.5, 1.7)
            spots = place + rng.normal(scale=0.15, size=(20, 2))
            turn = float(rng.uniform(0, 360))
            spot = next((spot for spot in spots if self.clear(spot, height)), place)
            poses.append(at(spot[0], spot[1], height, turn))
        return poses

    def clear(self, spot: Array, height: float) -> bool:
        """Whether a tripod may stand there."""
        levels = np.linspace(TRIPOD + 0.05, height, 8)
        column = np.column_stack([np.tile(spot, (8, 1)), levels])
        near = self.scene.around(column.mean(axis=0), height)
        return not near.solids or bool((near.clearance(column) >= TRIPOD).all())


def along(path: Array, count: int, closed: bool) -> Array:
    """Places (count, 2), equally spaced along a path; a closed one does not end where it began."""
    corners = np.vstack([path, path[:1]]) if closed else path
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    marks = np.concatenate([[0.0], np.cumsum(lengths)])
    wanted = np.linspace(0, marks[-1], count, endpoint=not closed)
    return np.column_stack([np.interp(wanted, marks, corners[:, axis]) for axis in (0, 1)])


def dense(path: Sequence[tuple[float, float]], closed: bool) -> Array:
    """The path as points about 0.2 m apart (K, 2), to be kept free."""
    corners = np.array(path, dtype=float)
    closing = np.vstack([corners, corners[:1]]) if closed else corners
    length = float(np.linalg.norm(np.diff(closing, axis=0), axis=1).sum())
    return along(corners, max(int(length / 0.2), 2), closed)
