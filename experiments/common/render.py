"""Render point clouds as shaded surfaces, in software and identically on every machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree
from mvreg.types import Array, Indices

CLAY = np.array([0.80, 0.76, 0.70])
#: So many pixels, each way, are painted for one of the picture.
FINER = 3
#: Radius of a point (mm), somewhat more than the spacing of the scans.
DOT = 0.7
#: Towards the light, in the frame of the picture: x to the right, y up, z to the eye.
LIGHT = np.array([-0.45, 0.55, 0.70])


@dataclass(frozen=True, eq=False)
class Cloud:
    """Coloured points (N, 3) with unit normals (N, 3) and colours (N, 3) between 0 and 1."""

    points: Array
    normals: Array
    colours: Array

    def moved(self, transform: Array) -> Cloud:
        """The cloud in another frame."""
        normals = self.normals @ transform[:3, :3].T
        return Cloud(se3.apply(transform, self.points), normals, self.colours)

    def seen_from(self, T_world_eye: Array) -> Cloud:
        """The cloud in the frame of an eye that looks along -z."""
        return self.moved(se3.invert(T_world_eye))

    def painted(self, colour: Array) -> Cloud:
        """The same in one colour."""
        return Cloud(self.points, self.normals, np.broadcast_to(colour, self.points.shape))


def together(clouds: Sequence[Cloud]) -> Cloud:
    """All the points of several clouds."""
    parts = zip(*((c.points, c.normals, c.colours) for c in clouds), strict=True)
    return Cloud(*(np.concatenate(part) for part in parts))


def render(cloud: Cloud, width: float, height: float, scale: float, dot: float = DOT) -> Array:
    """Paint a cloud, in the frame of the eye and around its origin; far points first.

    Parameters
    ----------
    cloud : Cloud
    width, height : float
        Of the picture (mm).
    scale : float
        Pixels per mm.
    dot : float
        Radius of a point (mm).

    Returns
    -------
    (rows, columns, 3) array
        Between 0 and 1, on white.
    """
    step = scale * FINER
    shape = np.array([round(height * scale), round(width * scale)]) * FINER
    facing = cloud.normals[:, 2] > 0
    points, normals = cloud.points[facing], cloud.normals[facing]
    colours = shaded(normals, cloud.colours[facing])
    order = np.argsort(points[:, 2], kind="stable")
    rows = np.rint(shape[0] / 2 - points[order, 1] * step).astype(int)
    columns = np.rint(shape[1] / 2 + points[order, 0] * step).astype(int)
    image = np.ones((*shape, 3))
    depth = np.full(shape, -np.inf)
    for down, right in disc(dot * step):
        row, column = rows + down, columns + right
        inside = (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
        paint(image, depth, row[inside], column[inside], points[order][inside, 2],
              colours[order][inside])  # fmt: skip
    return coarsened(image)


def paint(
    image: Array, depth: Array, row: Indices, column: Indices, z: Array, colours: Array
) -> None:
    """Paint one pixel per point where it is in front of what is there; `z` (N,) ascends."""
    nearer = z > depth[row, column]
    row, column = row[nearer], column[nearer]
    depth[row, column] = z[nearer]  # of several points in one pixel the last, the nearest, stays
    image[row, column] = colours[nearer]


def shaded(normals: Array, colours: Array) -> Array:
    """Colours (N, 3) of a dull surface under one light."""
    light = LIGHT / np.linalg.norm(LIGHT)
    bright = 0.32 + 0.74 * np.clip(normals @ light, 0, 1) + 0.12 * normals[:, 2]
    lit: Array = np.clip(colours * bright[:, None], 0, 1)
    return lit


def disc(radius: float) -> list[tuple[int, int]]:
    """The pixels of a disc around the origin."""
    reach = range(-int(radius), int(radius) + 1)
    return [(i, j) for i in reach for j in reach if i * i + j * j <= radius * radius]


def coarsened(image: Array) -> Array:
    """Means over squares of pixels: smooth edges."""
    rows, columns = image.shape[0] // FINER, image.shape[1] // FINER
    smooth: Array = image.reshape(rows, FINER, columns, FINER, 3).mean(axis=(1, 3))
    return smooth


def laid_out(clouds: Sequence[Cloud], columns: int, width: float, height: float) -> Cloud:
    """Clouds side by side in rows, each as its sensor saw it."""
    rows = -(-len(clouds) // columns)
    spread = []
    for index, cloud in enumerate(clouds):
        row, column = divmod(index, columns)
        middle = (cloud.points.min(axis=0) + cloud.points.max(axis=0)) / 2
        across, up = column - (columns - 1) / 2, (rows - 1) / 2 - row
        shift = np.array([across * width, up * height, 0])
        spread.append(Cloud(cloud.points - middle + shift, cloud.normals, cloud.colours))
    return together(spread)


def smoothed(cloud: Cloud, neighbours: int = 24) -> Cloud:
    """The cloud with normals averaged over neighbours that face the same way."""
    tree = build_tree(cloud.points)
    _, indices = tree.query(cloud.points, k=neighbours)
    nearby = cloud.normals[indices]
    same = np.einsum("nkc,nc->nk", nearby, cloud.normals) > 0
    total = (nearby * same[..., None]).sum(axis=1)
    normals = total / np.linalg.norm(total, axis=1, keepdims=True)
    return Cloud(cloud.points, normals, cloud.colours)
