"""Thin scans out to so many points, whatever they have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import check_positive
from mvreg.parallel import in_threads
from mvreg.stages.downsample.sampling import DENSEST
from mvreg.stages.downsample.voxels import step_for_count, surface_centroids
from mvreg.types import Sample, Scan


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

        def thinned(scan: Scan) -> Sample:
            points = surface_centroids(scan.points, step) if thin else scan.points
            return Sample(points, surface_centroids(scan.points, spacing))

        return in_threads(thinned, scans), spacing
