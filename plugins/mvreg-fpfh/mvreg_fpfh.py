"""Open3D's fast point feature histograms as a stage of mvreg: ``describe=fpfh``."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import mvreg
from mvreg.surface import Orient, estimate_normals, orient
from mvreg.types import Array, Features, Scan


@dataclass(frozen=True)
class FpfhDescribe:
    """Fast point feature histograms by Open3D (33-D; Rusu, Blodow and Beetz, ICRA 2009).

    Parameters
    ----------
    radius : float
        Points within it are described, in units of the keypoints' spacing.
    stride : int
        Every `stride`-th point of the scan is enough.
    """

    radius: float = 1.5
    stride: int = 10

    def __post_init__(self) -> None:
        if not (self.radius > 0 and self.stride > 0):
            raise mvreg.InputError(
                f"describe: expected radius > 0 and stride > 0, got {self.radius} and {self.stride}"
            )

    def __call__(self, scan: Scan, keypoints: Array, spacing: float) -> Features:
        open3d = mvreg.load_open3d()
        points = np.concatenate([keypoints, scan.points[:: self.stride]])
        normals, oriented = orient(
            estimate_normals(scan, points, Orient.fold), points, scan, Orient.auto
        )
        if not oriented:  # FPFH needs some sign
            normals = outwards(points, normals)
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
        cloud.normals = open3d.utility.Vector3dVector(normals)
        nearby = open3d.geometry.KDTreeSearchParamRadius(self.radius * spacing)
        fpfh = open3d.pipelines.registration.compute_fpfh_feature(cloud, nearby).data
        # Three histograms, each of which adds up to 200; those of a lonely point are empty.
        descriptors = np.asarray(fpfh).T[: len(keypoints)] / 200
        found = np.flatnonzero(descriptors.any(axis=1))
        return Features(keypoints[found], normals[found, None], descriptors[found], oriented)


def outwards(points: Array, normals: Array) -> Array:
    """Turn normals (N, 3) to one side, as what one sensor sees faces it: the bulging side."""
    axis = np.linalg.eigh(normals.T @ normals)[1][:, -1]
    normals = np.where(normals @ axis[:, None] < 0, -normals, normals)
    bulge = ((points - points.mean(axis=0)) * normals).sum()
    return normals if bulge >= 0 else -normals


@mvreg.hookimpl
def mvreg_stages() -> dict[str, type]:
    return {"describe/fpfh": FpfhDescribe}


@mvreg.hookimpl
def mvreg_suites() -> dict[str, type]:
    from mvreg.testing import DescribeContract

    class FpfhSuite(DescribeContract):
        stage = FpfhDescribe()

        def same(self, old: Features, new: Features, turn: Array) -> None:
            # FPFH counts angles in bins, and where two angles tie rounding decides.
            changed = np.abs(new.descriptors - old.descriptors) > self.tolerance
            if changed.mean() < 0.01:
                new = replace(new, descriptors=old.descriptors)
            super().same(old, new, turn)

    return {"describe/fpfh": FpfhSuite}
