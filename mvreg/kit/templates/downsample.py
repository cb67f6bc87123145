"""Points to refine on and keypoints to search with: ``downsample=nameless``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import check_positive
from mvreg.geometry import Array
from mvreg.geometry.nearest import median_spacing
from mvreg.types import Sample, Scan


@dataclass(frozen=True)
class NamelessDownsample:
    """Means of the points in the cells of a grid, twice: a fine one and a coarse one.

    Parameters
    ----------
    points, keypoints : float
        Sides of the cells, in units of the mean distance between the scans' points: so the unit of
        length does not matter.
    """

    points: float = 1.5
    keypoints: float = 4.0

    def __post_init__(self) -> None:
        check_positive("downsample", points=self.points, keypoints=self.keypoints)

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        """Thin scans out; `rng` is not used.

        Returns
        -------
        samples : list of Sample
            In the order of the scans.
        spacing : float
            The side of the coarse cells (length), the same for all scans.
        """
        between = median_spacing([scan.points for scan in scans]) or 1.0  # all points in one place
        spacing = self.keypoints * between
        samples = [
            Sample(means(scan.points, self.points * between), means(scan.points, spacing))
            for scan in scans
        ]
        return samples, spacing


def means(points: Array, side: float) -> Array:
    """Means (M, 3) of the points (N, 3) in each cell of a grid with cubes of a `side` (length)."""
    cells = np.floor((points - points.min(axis=0)) / side).astype(np.int64)
    _, cell, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    total = np.zeros((len(counts), 3))
    np.add.at(total, cell.reshape(-1), points)
    found: Array = total / counts[:, None]
    return found
