"""Thin scans out: registration points to refine on, keypoints to search with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import check_positive
from mvreg.stages.downsample.voxels import spacing_for_ratio, step_that_leaves, voxel_centroids
from mvreg.surface.spacing import raw_resolution
from mvreg.types import Sample, Scan

#: Keypoints any denser, one in so many points, would have too few neighbours to describe them.
DENSEST = 12.0


def median_size(scans: Sequence[Scan]) -> float:
    """How many points the median scan has."""
    return float(np.median([len(scan.points) for scan in scans]))


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
        size = median_size(scans)
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
    min_points, min_keypoints : int
        The strides are shorter where the median scan would keep fewer, as in `PaperDownsample`.
    """

    stride: int = 10
    keypoint_stride: int = 100
    min_points: int = 3000
    min_keypoints: int = 300

    def __post_init__(self) -> None:
        check_positive(
            "downsample",
            stride=self.stride,
            keypoint_stride=self.keypoint_stride,
            min_points=self.min_points,
            min_keypoints=self.min_keypoints,
        )

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        size = median_size(scans)
        stride = min(self.stride, max(1, int(size / self.min_points)))
        ratio = min(self.keypoint_stride, max(int(DENSEST), int(size / self.min_keypoints)))
        return [
            Sample(scan.points[::stride], scan.points[::ratio]) for scan in scans
        ], spacing_for_ratio(scans, ratio)


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
    min_points, min_keypoints : int
        The steps are shorter where the median scan would keep fewer; it keeps at most one keypoint
        in 12 points for that.
    """

    step: float = 5.0
    keypoint_step: float = 18.0
    min_points: int = 3000
    min_keypoints: int = 300

    def __post_init__(self) -> None:
        check_positive(
            "downsample",
            step=self.step,
            keypoint_step=self.keypoint_step,
            min_points=self.min_points,
            min_keypoints=self.min_keypoints,
        )

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        resolution = raw_resolution(scans) or 1.0
        size = median_size(scans)
        step = step_that_leaves(scans, self.step * resolution, min(self.min_points, size))
        spacing = step_that_leaves(
            scans, self.keypoint_step * resolution, min(self.min_keypoints, size / DENSEST)
        )
        return [
            Sample(voxel_centroids(scan.points, step), voxel_centroids(scan.points, spacing))
            for scan in scans
        ], spacing
