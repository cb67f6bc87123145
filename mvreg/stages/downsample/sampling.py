"""Thin scans out: registration points to refine on, keypoints to search with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import check_positive
from mvreg.stages.downsample.voxels import spacing_for_ratio, voxel_centroids
from mvreg.surface.spacing import raw_resolution
from mvreg.types import Sample, Scan

#: Keypoints any denser, one in so many points, would have too few neighbours to describe them.
DENSEST = 12.0


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
        resolution = raw_resolution(scans) or 1.0
        spacing = self.keypoint_step * resolution
        return [
            Sample(
                voxel_centroids(scan.points, self.step * resolution),
                voxel_centroids(scan.points, spacing),
            )
            for scan in scans
        ], spacing
