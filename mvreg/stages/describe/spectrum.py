"""Multi-scale eigenvalue descriptors and normals, all radii in one pass."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mvreg.errors import InputError, check_ascending, check_positive
from mvreg.geometry.nearest import build_tree
from mvreg.kernels.grid import Cells
from mvreg.kernels.moments import moments
from mvreg.surface.normals import Orient, orient
from mvreg.types import Array, Features, Scan

#: How far apart the descriptors of `SpectrumDescribe` lie, see `mvreg.types.estimated_spread`: 0.13
#: to 0.23 on tiny, figurine, Bunny, Dragon and Buddha, the median 0.21, by
#: ``python -m experiments.accuracy.descriptor_spread``. One constant, so that the tolerance of a
#: match is the same for flat and for rugged scans.
SPREAD = 0.2


def neighbourhood_moments(
    scan: Scan, keypoints: Array, radii: Array, stride: int = 1, cell: float = 0.0
) -> tuple[Array, Array, Array]:
    """`mvreg.kernels.moments.moments` of every `stride`-th raw point of a scan.

    Or of the means of the points in cells of a length.
    """
    if cell > 0:
        tree = build_tree(Cells(scan.points, cell).means)
    else:
        tree = build_tree(scan.points[::stride]) if stride > 1 else scan.tree
    return moments(tree, keypoints, radii)


@dataclass(frozen=True)
class SpectrumDescribe:
    """Differences between scales of the normalised spectra of local covariances (9-D).

    ``C_l`` is taken about the keypoint over the raw points within ``l * spacing / 2``; its
    eigenvalues, divided by their sum, are ``s_l``; the descriptor is ``[s_2 - s_1, s_3 - s_2,
    ...]`` and the normals are the eigenvectors of the smallest eigenvalues (Sec. 3.1 of the paper,
    made precise after the authors' published code).

    Parameters
    ----------
    scales : int
        Number of radii, the paper's L.
    min_neighbours : int
        Keypoints with fewer raw points within the smallest radius are dropped.
    orient : Orient
        Which way the normals point.
    even : float
        Neighbours are the means of the points in cells of so many spacings of the keypoints, so
        that a surface looks the same however densely it was sampled; 0, as in the paper, takes the
        raw points.
    """

    scales: int = 4
    min_neighbours: int = 11
    orient: Orient = Orient.auto
    even: float = 0.0

    def __post_init__(self) -> None:
        check_positive("describe", min_neighbours=self.min_neighbours)
        if not self.even >= 0:
            raise InputError(f"describe.even: expected 0 or more, got {self.even}")
        if self.scales < 2:
            raise InputError(f"describe.scales: expected at least 2, got {self.scales}")

    def __call__(self, scan: Scan, keypoints: Array, spacing: float) -> Features:
        radii = np.arange(1, self.scales + 1) * spacing / 2
        count, _, second = neighbourhood_moments(scan, keypoints, radii, cell=self.even * spacing)
        spread = np.trace(second[:, 0], axis1=1, axis2=2) / np.maximum(count[:, 0], 1)
        # Neighbours that all lie on the keypoint have no shape.
        dense = (count[:, 0] >= self.min_neighbours) & (spread > (1e-9 * radii[0]) ** 2)
        keypoints, second = keypoints[dense], second[dense]
        values, vectors = np.linalg.eigh(second)
        spectrum = values[..., ::-1] / values.sum(axis=-1, keepdims=True)
        descriptors = np.diff(spectrum, axis=1).reshape(len(keypoints), 3 * (self.scales - 1))
        normals, oriented = orient(vectors[..., 0], keypoints, scan, self.orient)
        return Features(keypoints, normals, descriptors, oriented, SPREAD)


@dataclass(frozen=True)
class NoDescribe:
    """Leave every keypoint out, for strategies that search by other means."""

    def __call__(self, scan: Scan, keypoints: Array, spacing: float) -> Features:
        return Features(np.empty((0, 3)), np.empty((0, 1, 3)), np.empty((0, 1)), oriented=False)


@dataclass(frozen=True)
class EigenvaluesDescribe:
    """Square roots of the eigenvalues over the radius, covariance about the mean (12-D).

    The looser relative of `SpectrumDescribe`: it keeps the size of the spectrum, and one normal.

    Parameters
    ----------
    radii : list of float
        In units of the keypoints' spacing, ascending.
    normal_scale : int
        Which radius gives the normal.
    stride : int
        Every `stride`-th raw point serves as neighbour.
    min_neighbours : int
        Keypoints with fewer neighbours within the smallest radius are dropped.
    orient : Orient
        Which way the normals point.
    """

    radii: list[float] = field(default_factory=lambda: [0.4, 0.7, 1.0, 1.4])
    normal_scale: int = 1
    stride: int = 3
    min_neighbours: int = 4
    orient: Orient = Orient.auto

    def __post_init__(self) -> None:
        check_positive("describe", stride=self.stride, min_neighbours=self.min_neighbours)
        check_ascending("describe", radii=self.radii)
        if not 0 <= self.normal_scale < len(self.radii):
            raise InputError(
                f"describe.normal_scale: expected one of the {len(self.radii)} radii, counted from "
                f"0, got {self.normal_scale}"
            )

    def __call__(self, scan: Scan, keypoints: Array, spacing: float) -> Features:
        radii = np.asarray(self.radii) * spacing
        count, first, second = neighbourhood_moments(scan, keypoints, radii, self.stride)
        dense = count[:, 0] >= self.min_neighbours
        keypoints, count = keypoints[dense], count[dense][..., None]
        mean = first[dense] / count
        covariance = second[dense] / count[..., None] - mean[..., :, None] * mean[..., None, :]
        values, vectors = np.linalg.eigh(covariance)
        descriptors = np.sqrt(np.clip(values[..., ::-1], 0, None)) / radii[:, None]
        normals = vectors[:, self.normal_scale : self.normal_scale + 1, :, 0]
        normals, oriented = orient(normals, keypoints, scan, self.orient)
        descriptors = descriptors.reshape(len(keypoints), 3 * len(radii))  # -1 fails for none
        return Features(keypoints, normals, descriptors, oriented)
