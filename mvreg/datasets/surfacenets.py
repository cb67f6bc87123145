"""A triangle mesh of parts joined, evaluated near the surface only.

Surface nets: Gibson, "Constrained elastic surface nets" (MICCAI 1998). Cells are halved as
in an octree, and know which parts can matter in them, so that only a few are evaluated at a point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.datasets.sdf import Part, evaluate
from mvreg.types import Array, Indices

#: Cells are this many steps wide at first, and 2 at last.
COARSEST = 8
#: How much steeper than a true distance relief can make a signed distance.
STEEPEST = 1.6
#: Of the vertices (steps), so that a processor that rounds otherwise has the same mesh.
DECIMALS = 6
CHILDREN = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
CORNERS = np.array([(i, j, k) for i in (0, 1, 2) for j in (0, 1, 2) for k in (0, 1, 2)])


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells `index` (C, 3) of `size` steps, and for each part the cells in which it matters."""

    index: Indices
    size: int
    active: list[Indices]


def surface_net(parts: Sequence[Part], step: float) -> tuple[Array, Indices]:
    """Mesh the surface of `parts` joined.

    Parameters
    ----------
    parts : sequence of Part
        Joined in this order.
    step : float
        Edge of the grid's cells, about the length of a triangle's edge.

    Returns
    -------
    vertices : (V, 3) array
    triangles : (T, 3) array
        Counter-clockwise seen from outside.
    """
    margin = COARSEST * step + _widest_blend(parts)
    lower = np.min([part.centre - part.radius for part in parts], axis=0) - margin
    upper = np.max([part.centre + part.radius for part in parts], axis=0) + margin
    cells = _all_cells(parts, lower, upper, step)
    cells = _prune(parts, cells, lower, step)
    while cells.size > 2:
        cells = _prune(parts, _split(cells), lower, step)
    values = _sample(parts, cells, lower, step)
    vertices, triangles = _net(values)
    vertices = lower + step * vertices
    settled = _settle(parts, cells, lower, step, vertices, triangles)
    return np.round(settled / step, DECIMALS) * step, triangles


def _all_cells(parts: Sequence[Part], lower: Array, upper: Array, step: float) -> Cells:
    width = COARSEST * step
    counts = np.ceil((upper - lower) / width).astype(int)
    index = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    centres = lower + (index + 0.5) * width
    reach = _widest_blend(parts) + STEEPEST * np.sqrt(3) / 2 * width
    active = [
        np.flatnonzero(((centres - part.centre) ** 2).sum(axis=1) < (part.radius + reach) ** 2)
        for part in parts
    ]
    return Cells(index, COARSEST, active)


def _widest_blend(parts: Sequence[Part]) -> float:
    return max(part.blend for part in parts)


def _split(cells: Cells) -> Cells:
    index = (2 * cells.index[:, None, :] + CHILDREN).reshape(-1, 3)
    active = [(8 * where[:, None] + np.arange(8)).ravel() for where in cells.active]
    return Cells(index, cells.size // 2, active)


def _prune(parts: Sequence[Part], cells: Cells, lower: Array, step: float) -> Cells:
    """Drop cells that the surface cannot cross, and parts from cells that they cannot reach."""
    reach = STEEPEST * np.sqrt(3) / 2 * cells.size * step
    centres = lower + (cells.index + 0.5) * cells.size * step
    together, apart = evaluate(parts, centres, cells.active)
    keep = np.abs(together) < reach
    number = np.cumsum(keep) - 1
    blend = _widest_blend(parts)
    active = [
        number[where[(distance < reach + blend) & keep[where]]]
        for where, distance in zip(cells.active, apart, strict=True)
    ]
    return Cells(cells.index[keep], cells.size, active)


def _sample(parts: Sequence[Part], cells: Cells, lower: Array, step: float) -> Array:
    """The signed distances on the grid, at all corners within the cells; NaN elsewhere."""
    shape = tuple(cells.size * (cells.index.max(axis=0) + 1) + 1)
    corners = (cells.size * cells.index)[:, None, :] + CORNERS
    flat = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), shape)
    wanted = np.zeros(int(np.prod(shape)), dtype=bool)
    wanted[flat] = True
    used = np.flatnonzero(wanted)
    number = np.cumsum(wanted) - 1
    corner = number[flat]
    active = [_flagged(corner[where], len(used)) for where in cells.active]
    points = lower + step * np.column_stack(np.unravel_index(used, shape))
    values = np.full(shape, np.nan)
    values.ravel()[used] = evaluate(parts, points, active)[0]
    return values


def _flagged(indices: Indices, count: int) -> Indices:
    """The different ones among `indices`, all below `count`, in order."""
    flags = np.zeros(count, dtype=bool)
    flags[indices] = True
    return np.flatnonzero(flags)


def _net(values: Array) -> tuple[Array, Indices]:
    """Vertices (in grid steps) and triangles of the zero set of values on a grid, NaN unknown."""
    flat, inside, known = values.ravel(), values.ravel() < 0, ~np.isnan(values.ravel())
    strides = np.array([values.shape[1] * values.shape[2], values.shape[2], 1])
    crossings, rings, quads = [], [], []
    for axis, stride in enumerate(strides):
        change = (inside[:-stride] != inside[stride:]) & known[:-stride] & known[stride:]
        cut = np.flatnonzero(change)
        crossing = np.column_stack(np.unravel_index(cut, values.shape)).astype(float)
        crossing[:, axis] += flat[cut] / (flat[cut] - flat[cut + stride])
        u, v = strides[(axis + 1) % 3], strides[(axis + 2) % 3]
        ring = cut[:, None] - np.array([0, u, u + v, v])
        crossings.append(np.repeat(crossing, 4, axis=0))
        rings.append(ring.ravel())
        quads.append(np.where(inside[cut][:, None], ring, ring[:, ::-1]))
    number = np.zeros(values.size, dtype=np.intp)
    number[np.concatenate(rings)] = 1
    number = np.cumsum(number) - 1
    cells, points = number[np.concatenate(rings)], np.vstack(crossings)
    sums = np.column_stack([np.bincount(cells, column) for column in points.T])
    quad = number[np.vstack(quads)]
    vertices = sums / np.bincount(cells)[:, None]
    return vertices, np.vstack([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])


def _settle(parts: Sequence[Part], cells: Cells, lower: Array, step: float, vertices: Array,
            triangles: Indices) -> Array:  # fmt: skip
    """Move the vertices along the normals by what they are off the surface, half a step at most."""
    shape = tuple(cells.index.max(axis=0) + 1)
    number = np.full(shape, -1)
    number[tuple(cells.index.T)] = np.arange(len(cells.index))
    cell = number[tuple(((vertices - lower) / (cells.size * step)).astype(int).T)]
    active = []
    for where in cells.active:
        flags = np.zeros(len(cells.index) + 1, dtype=bool)
        flags[where] = True
        active.append(np.flatnonzero(flags[cell]))
    value = evaluate(parts, vertices, active)[0]
    value[cell < 0] = 0
    shift = np.clip(value, -step / 2, step / 2)[:, None] * vertex_normals(vertices, triangles)
    moved: Array = vertices - shift
    return moved


def vertex_normals(vertices: Array, triangles: Indices) -> Array:
    """Unit normals (V, 3), the triangles' weighted by area."""
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.column_stack(
        [np.bincount(triangles.ravel(), np.repeat(c, 3), len(vertices)) for c in normals.T]
    )
    unit: Array = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300)
    return unit
