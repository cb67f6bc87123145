"""How solids are made and put where they belong; lengths in metres, angles in degrees."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from mvreg.datasets.environments.scene import moved
from mvreg.datasets.environments.solids import Cylinder, Ellipsoid, Polyhedron, Solid
from mvreg.datasets.relief import turned
from mvreg.geometry import se3
from mvreg.types import Array

Point = Sequence[float]


def at(x: float, y: float, z: float = 0.0, turn: float = 0.0, tilt: float = 0.0) -> Array:
    """A pose (4, 4): leant back by `tilt` about x, turned by `turn` about z, moved to (x, y, z)."""
    rotation: Array = turned(z=turn, x=tilt).astype(np.float64)
    return se3.from_parts(rotation, np.array([x, y, z], dtype=float))


def put(solids: Iterable[Solid], x: float, y: float, z: float = 0.0,
        turn: float = 0.0) -> list[Solid]:  # fmt: skip
    """Things that were built around the origin, turned about z and moved to (x, y, z)."""
    return moved(solids, at(x, y, z, turn))


def box(size: Point, foot: Point, turn: float = 0.0, tilt: float = 0.0) -> Polyhedron:
    """A box of `size` (x, y, z) that stands on the point `foot`, before it is tilted."""
    half = np.array(size, dtype=float) / 2
    normals = np.vstack([np.eye(3), -np.eye(3)])
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    pose = at(foot[0], foot[1], foot[2] + half[2], turn, tilt)
    return Polyhedron(pose, normals, np.tile(half, 2), signs * half)


def between(lower: Point, upper: Point) -> Polyhedron:
    """The box along the axes between two of its corners."""
    low, high = np.array(lower, dtype=float), np.array(upper, dtype=float)
    foot = (low + high) / 2
    return box((high - low).tolist(), (foot[0], foot[1], low[2]))


def prism(profile: Sequence[tuple[float, float]], length: float) -> Polyhedron:
    """A convex profile of points (y, z), counter-clockwise from +x, stretched along x.

    It extends to both sides of the plane x = 0, by half the length: gabled roofs, cabins of cars.
    """
    corners = np.array(profile, dtype=float)
    middle = corners.mean(axis=0)
    corners = corners - middle
    edges = np.roll(corners, -1, axis=0) - corners
    sides = np.column_stack([np.zeros(len(edges)), edges[:, 1], -edges[:, 0]])
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    normals = np.vstack([sides, [[1, 0, 0], [-1, 0, 0]]])
    offsets = np.append(np.einsum("ij,ij->i", sides[:, 1:], corners), [length / 2] * 2)
    vertices = np.vstack([np.insert(corners, 0, x, axis=1) for x in (-length / 2, length / 2)])
    return Polyhedron(at(0, middle[0], middle[1]), normals, offsets, vertices)


def tube(start: Point, end: Point, radius: float) -> Cylinder:
    """A cylinder from one point to another."""
    first, last = np.array(start, dtype=float), np.array(end, dtype=float)
    length = float(np.linalg.norm(last - first))
    axis = (last - first) / length
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    rotation = np.column_stack([side, np.cross(axis, side), axis])
    return Cylinder(se3.from_parts(rotation, (first + last) / 2), radius, length / 2)


def pillar(radius: float, height: float, foot: Point) -> Cylinder:
    """An upright cylinder on the point `foot`."""
    return tube(foot, (foot[0], foot[1], foot[2] + height), radius)


def ball(radii: Point, centre: Point, turn: float = 0.0) -> Ellipsoid:
    """An ellipsoid about `centre`."""
    return Ellipsoid(at(centre[0], centre[1], centre[2], turn), np.array(radii, dtype=float))


def wall(
    start: tuple[float, float], end: tuple[float, float], height: float,
    openings: Sequence[tuple[float, float, float, float]] = (), thickness: float = 0.2,
) -> list[Solid]:  # fmt: skip
    """A wall with openings (left, right, bottom, top).

    Its inner face goes from `start` to `end`, which is to the right; the thickness is behind it.
    The openings are measured from `start`; windows, which do not begin at the floor, have a pane.
    """
    length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
    back = thickness
    pieces: list[Solid] = []
    edge = 0.0
    for left, right, bottom, top in sorted(openings):
        pieces.append(between((edge, 0, 0), (left, back, height)))
        pieces.append(between((left, 0, top), (right, back, height)))
        if bottom > 0:
            pieces.append(between((left, 0, 0), (right, back, bottom)))
            pieces.append(between((left, back - 0.04, bottom), (right, back, top)))
        edge = right
    pieces.append(between((edge, 0, 0), (length, back, height)))
    turn = float(np.degrees(np.arctan2(end[1] - start[1], end[0] - start[0])))
    return put(pieces, *start, turn=turn)
