"""Descriptors and normals of keypoints: ``describe=nameless``."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from mvreg.errors import check_ascending, check_positive
from mvreg.surface import Orient, orient
from mvreg.types import Array, Features, Scan


@dataclass(frozen=True)
class NamelessDescribe:
    """Shape of the neighbourhood at several scales: shares of the covariance's eigenvalues.

    Parameters
    ----------
    radii : list of float
        Ascending, in units of the keypoints' spacing.
    fewest : int
        A keypoint with fewer points within the smallest radius is left out.
    """

    radii: list[float] = field(default_factory=lambda: [0.75, 1.25, 2.0])
    fewest: int = 8

    def __post_init__(self) -> None:
        check_ascending("describe", radii=self.radii)
        check_positive("describe", fewest=self.fewest)

    def __call__(self, scan: Scan, keypoints: Array, spacing: float) -> Features:
        """Describe keypoints (K, 3) of a scan.

        Returns
        -------
        Features
            Of those keypoints that have neighbours: normals (K, L, 3) and descriptors (K, 2 L), for
            L radii.
        """
        described, normals, descriptors = [], [], []
        around = cKDTree(scan.points).query_ball_point(keypoints, self.radii[-1] * spacing)
        for keypoint, indices in zip(keypoints, around, strict=True):
            points = scan.points[indices]
            away = np.linalg.norm(points - keypoint, axis=1)
            inside = [points[away <= radius * spacing] for radius in self.radii]
            if len(inside[0]) < self.fewest or np.ptp(inside[0], axis=0).max() < 1e-9 * spacing:
                continue
            found = [shape(neighbours) for neighbours in inside]
            described.append(keypoint)
            normals.append([normal for normal, _ in found])
            descriptors.append(np.concatenate([shares for _, shares in found]))
        scales = len(self.radii)
        kept = np.array(described).reshape(-1, 3)
        turned, oriented = orient(np.array(normals).reshape(-1, scales, 3), kept, scan, Orient.auto)
        return Features(kept, turned, np.array(descriptors).reshape(-1, 2 * scales), oriented)


def shape(points: Array) -> tuple[Array, Array]:
    """The normal (3,) of points (N, 3), and how flat and how long they lie (2,)."""
    values, vectors = np.linalg.eigh(np.cov(points.T))
    return vectors[:, 0], values[:2] / values.sum()
