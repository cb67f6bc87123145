"""Thin scans out: registration points to refine on, keypoints to search with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import check_positive
from mvreg.nearest import median_spacing
from mvreg.types import Array, Indices, Sample, Scan

#: Cells with less than this share of the points of a cell on the surface are left out, and cells
#: with one point where others hold so many. Of the Bunny's scans a quarter would leave out two
#: cells in five, and pairs that the search finds; this leaves out one in fifty.
SPARSE, CROWDED = 0.05, 8
#: Keypoints any denser, one in so many points, would have too few neighbours to describe them.
DENSEST = 12.0


def voxel_of(points: Array, step: float) -> tuple[Indices, int]:
    """Number the occupied cells of a grid: the cell of each point (N,), and how many there are."""
    cells = np.floor((points - points.min(axis=0)) / step).astype(np.int64)
    size = cells.max(axis=0) + 1
    keys = (cells[:, 0] * size[1] + cells[:, 1]) * size[2] + cells[:, 2]
    unique, inverse = np.unique(keys, return_inverse=True)
    return inverse, len(unique)


def voxel_centroids(points: Array, step: float) -> Array:
    """Mean of the points (N, 3) in each occupied cell of a grid of `step` (length)."""
    cell, count = voxel_of(points, step)
    sums = [np.bincount(cell, points[:, axis], count) for axis in range(3)]
    centroids: Array = np.stack(sums, axis=1) / np.bincount(cell, minlength=count)[:, None]
    return centroids


def spacing_for_ratio(scans: Sequence[Scan], ratio: float) -> float:
    """The grid step that leaves about one point in `ratio`, over all the scans together (length).

    A secant search in log-log, to 3 per cent: occupied cells fall with the square of the step.
    """
    resolution = median_spacing([scan.points for scan in scans])
    if resolution == 0:
        return 1.0
    wanted = sum(len(scan.points) for scan in scans) / ratio
    step = resolution * 1.8 * np.sqrt(ratio)
    for _ in range(12):
        count = sum(voxel_of(scan.points, step)[1] for scan in scans)
        if abs(count / wanted - 1) < 0.03:
            break
        step *= np.sqrt(count / wanted)
    return float(step)


@dataclass(frozen=True)
class PaperDownsample:
    """Every 10th point to refine on, grid centroids (about 1 point in 100) as keypoints.

    The paper's sampling frequencies 10 and 100; as in the authors' published code the first is a
    stride in file order and the second a grid, whose step is one for the whole set.

    Parameters
    ----------
    stride : int
        Every `stride`-th point is kept for refinement.
    keypoint_ratio : float
        About one point in `keypoint_ratio` becomes a keypoint.
    min_points, min_keypoints : int
        Scans smaller than the paper's are thinned out less, so that the median scan keeps about as
        many: 3,000 and 300 leave the Stanford scans (30,000 points and more) at 10 and 100.
    """

    stride: int = 10
    keypoint_ratio: float = 100.0
    min_points: int = 3000
    min_keypoints: int = 300

    def __post_init__(self) -> None:
        check_positive(
            "downsample",
            stride=self.stride,
            keypoint_ratio=self.keypoint_ratio,
            min_points=self.min_points,
            min_keypoints=self.min_keypoints,
        )

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        size = float(np.median([len(scan.points) for scan in scans]))
        stride = min(self.stride, max(1, int(size / self.min_points)))
        ratio = min(self.keypoint_ratio, max(DENSEST, size / self.min_keypoints))
        spacing = spacing_for_ratio(scans, ratio)
        return [
            Sample(scan.points[::stride], voxel_centroids(scan.points, spacing)) for scan in scans
        ], spacing


@dataclass(frozen=True)
class StrideDownsample:
    """Every n-th point, for refinement and for keypoints: the cheapest there is.

    Parameters
    ----------
    stride, keypoint_stride : int
        As in the paper, 10 and 100.
    """

    stride: int = 10
    keypoint_stride: int = 100

    def __post_init__(self) -> None:
        check_positive("downsample", stride=self.stride, keypoint_stride=self.keypoint_stride)

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        return [
            Sample(scan.points[:: self.stride], scan.points[:: self.keypoint_stride])
            for scan in scans
        ], spacing_for_ratio(scans, self.keypoint_stride)


@dataclass(frozen=True)
class VoxelDownsample:
    """Grid centroids for both, with steps in units of the scans' resolution.

    Unlike strides it depends neither on the order of the points nor, beyond the grid's phase, on
    how densely a scan is sampled.

    Parameters
    ----------
    step, keypoint_step : float
        Grid steps in units of the median over the scans of the mean nearest-neighbour distance.
        The defaults leave about one point in 10 and in 100 of the Stanford scans.
    """

    step: float = 5.0
    keypoint_step: float = 18.0

    def __post_init__(self) -> None:
        check_positive("downsample", step=self.step, keypoint_step=self.keypoint_step)

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        resolution = median_spacing([scan.points for scan in scans]) or 1.0
        spacing = self.keypoint_step * resolution
        return [
            Sample(
                voxel_centroids(scan.points, self.step * resolution),
                voxel_centroids(scan.points, spacing),
            )
            for scan in scans
        ], spacing


def surface_centroids(points: Array, step: float) -> Array:
    """Mean of the points (N, 3) in each cell of a grid of `step` that is not all but empty.

    Where cells on the surface hold a dozen points or a hundred, those that hold one or four hold
    outliers. Where they hold hardly any all are kept.
    """
    cell, count = voxel_of(points, step)
    size = np.bincount(cell, minlength=count)
    sums = [np.bincount(cell, points[:, axis], count) for axis in range(3)]
    centroids: Array = np.stack(sums, axis=1) / size[:, None]
    usual = float(np.median(size[cell]))
    return centroids[size >= max(SPARSE * usual, 2.0 if usual >= CROWDED else 1.0)]


def step_for_count(scans: Sequence[Scan], wanted: float) -> float:
    """The grid step that leaves `wanted` surface cells in the median scan (length).

    A secant search in log-log, to 3 per cent, as in `spacing_for_ratio`.
    """
    resolution = median_spacing([scan.points for scan in scans])
    if resolution == 0:
        return 1.0
    size = float(np.median([len(scan.points) for scan in scans]))
    step = resolution * 1.8 * np.sqrt(size / wanted)
    for _ in range(12):
        count = np.median([len(surface_centroids(scan.points, step)) for scan in scans])
        if abs(count / wanted - 1) < 0.03:
            break
        step *= np.sqrt(count / wanted)
    return float(step)


@dataclass(frozen=True)
class GridDownsample:
    """Grid centroids for both, so many for the median scan, however many points it has.

    One grid step for all the scans: where one is sampled more thinly than the others it still has
    its points and keypoints as far apart as they. The cost of a pair does not grow with the size
    of the files. Cells with hardly any points in them are left out: outliers are.

    Parameters
    ----------
    points, keypoints : int
        Of the median scan, about: what one in 10 and one in 100 leave of the Bunny's scans. Scans
        with fewer than twice the points keep them all, and have at most one keypoint in 12 points.
    """

    points: int = 3500
    keypoints: int = 400

    def __post_init__(self) -> None:
        check_positive("downsample", points=self.points, keypoints=self.keypoints)

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        size = float(np.median([len(scan.points) for scan in scans]))
        spacing = step_for_count(scans, min(self.keypoints, size / DENSEST))
        # Fewer than two points a cell: a grid would only cost points.
        thin = size > 2 * self.points
        step = step_for_count(scans, self.points) if thin else 0.0
        return [
            Sample(
                surface_centroids(scan.points, step) if thin else scan.points,
                surface_centroids(scan.points, spacing),
            )
            for scan in scans
        ], spacing
