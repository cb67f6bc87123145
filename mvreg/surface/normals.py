"""Surface normals of point sets, and which way they point."""

from __future__ import annotations

from enum import Enum

import numpy as np

from mvreg.geometry.nearest import build_tree, nearest
from mvreg.kernels.moments import normals as plane_normals
from mvreg.types import Array, Features, Scan


class Orient(Enum):
    """Which way normals point.

    `auto` takes what the scan knows: its view direction, else its view point, else `fold`.
    `direction` and `point` ask for the one; `origin` is towards the scan's coordinate origin, as
    in the lab's published code; `fold` leaves the signs undetermined, and the stages then compare
    normals without their sign.
    """

    auto = "auto"
    direction = "direction"
    point = "point"
    origin = "origin"
    fold = "fold"


def orient(normals: Array, points: Array, scan: Scan, mode: Orient) -> tuple[Array, bool]:
    """Turn normals towards the sensor.

    Parameters
    ----------
    normals : (K, ..., 3) array
        Unit normals of any sign.
    points : (K, 3) array
        Where they stand, in the scan's frame.
    scan : Scan
        Knows its sensor, or does not.
    mode : Orient
        Which way.

    Returns
    -------
    normals : (K, ..., 3) array
    oriented : bool
        False where the signs mean nothing.
    """
    if mode is Orient.auto:
        known = (scan.view_direction is not None, scan.view_point is not None)
        mode = Orient.direction if known[0] else Orient.point if known[1] else Orient.fold
    if mode is Orient.direction and scan.view_direction is not None:
        towards = np.broadcast_to(scan.view_direction, points.shape)
    elif mode is Orient.point and scan.view_point is not None:
        towards = scan.view_point - points
    elif mode is Orient.origin:
        towards = -points
    else:
        return normals, False
    towards = towards.reshape(len(points), *([1] * (normals.ndim - 2)), 3)
    away = (normals * towards).sum(axis=-1, keepdims=True) < 0
    return np.where(away, -normals, normals), True


def align(normals: Array, points: Array, features: Features) -> Array:
    """Turn normals (N, 3) at `points` (N, 3) to the side of the nearest keypoint's normal.

    For scans that know no sensor, while their keypoints' normals have signs that mean something.
    """
    if len(features.keypoints) == 0:
        return normals
    _, closest = nearest(build_tree(features.keypoints), points)
    facing = features.normals[closest, 0]
    return np.where((normals * facing).sum(axis=1, keepdims=True) < 0, -normals, normals)


def facing_normals(scan: Scan, points: Array, features: Features) -> Array:
    """Unit normals at `points` (N, 3) of a scan, towards its sensor or as its keypoints' point."""
    normals = estimate_normals(scan, points, Orient.auto)
    if features.oriented and not scan.knows_sensor:
        return align(normals, points, features)
    return normals


def estimate_normals(scan: Scan, points: Array, mode: Orient, neighbours: int = 20) -> Array:
    """Unit normals at `points` (N, 3) from the raw scan's `neighbours` nearest points (PCA).

    Twenty neighbours reach about two and a half spacings. Undetermined signs stay as they
    come; a point with fewer than three neighbours gets some unit vector.
    """
    normals = plane_normals(scan.tree, points, neighbours)
    return orient(normals, points, scan, mode)[0]
