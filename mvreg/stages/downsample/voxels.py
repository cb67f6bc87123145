"""Grids over scans: what is in their cells, and how large the cells must be."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mvreg.kernels.grid import Cells
from mvreg.parallel import in_threads
from mvreg.surface.spacing import raw_resolution
from mvreg.types import Array, Scan

#: Cells with less than this share of the points of a cell on the surface are left out, and cells
#: with one point where others hold so many. Of the Bunny's scans a quarter would leave out two
#: cells in five, and pairs that the search finds; this leaves out one in fifty.
SPARSE, CROWDED = 0.05, 8


def voxel_centroids(points: Array, step: float) -> Array:
    """Mean of the points (N, 3) in each occupied cell of a grid of `step` (length)."""
    return Cells(points, step).means


def surface_centroids(points: Array, step: float) -> Array:
    """Mean of the points (N, 3) in each cell of a grid of `step` that is not all but empty.

    Where cells on the surface hold a dozen points or a hundred, those that hold one or four hold
    outliers. Where they hold hardly any all are kept.
    """
    cells = Cells(points, step)
    usual = float(np.median(np.repeat(cells.sizes, cells.sizes)))
    return cells.means[cells.sizes >= max(SPARSE * usual, 2.0 if usual >= CROWDED else 1.0)]


def spacing_for_ratio(scans: Sequence[Scan], ratio: float) -> float:
    """The grid step that leaves about one point in `ratio` of all the scans together (length)."""
    size = sum(len(scan.points) for scan in scans)
    return _step(
        scans, ratio, lambda step: sum(_each(scans, voxel_centroids, step)) / (size / ratio)
    )


def step_for_count(
    scans: Sequence[Scan],
    wanted: float,
    centroids: Callable[[Array, float], Array] = surface_centroids,
) -> float:
    """The grid step that leaves `wanted` cells, of the surface, in the median scan (length)."""
    size = float(np.median([len(scan.points) for scan in scans]))
    return _step(
        scans,
        size / wanted,
        lambda step: float(np.median(_each(scans, centroids, step))) / wanted,
    )


def step_that_leaves(scans: Sequence[Scan], step: float, least: float) -> float:
    """A grid step (length): `step`, less where the median scan would have fewer cells than that."""
    enough = np.median(_each(scans, voxel_centroids, step)) >= least
    return step if enough else min(step, step_for_count(scans, least, voxel_centroids))


def _each(
    scans: Sequence[Scan], centroids: Callable[[Array, float], Array], step: float
) -> list[int]:
    """How many centroids each scan has."""
    return in_threads(lambda scan: len(centroids(scan.points, step)), scans)


def _step(scans: Sequence[Scan], ratio: float, too_many: Callable[[float], float]) -> float:
    """The grid step at which a count over the wanted one is 1, to 3 per cent (length).

    A secant search in log-log: occupied cells fall with the square of the step. It begins where one
    point in `ratio` would be left of an even surface.
    """
    resolution = raw_resolution(scans)
    if resolution == 0:
        return 1.0
    step = resolution * 1.8 * np.sqrt(ratio)
    for _ in range(12):
        factor = too_many(step)
        if abs(factor - 1) < 0.03:
            break
        step *= np.sqrt(factor)
    return float(step)
