"""Surface normals of point sets, and which way they point."""

from __future__ import annotations

from enum import Enum

import numpy as np

from mvreg.geometry.nearest import build_tree, nearest
from mvreg.kernels.grid import Cells
from mvreg.kernels.moments import normals as plane_normals
from mvreg.surface.sensor import SensorModel, estimated_sensor, sensor_of, told_sensor
from mvreg.types import Array, Features, Scan

#: Share of the keypoints' normals that face a sensor, if they were turned towards it.
TURNED = 0.99
#: Points so many raw spacings apart get their normals from cells of a part of their own spacing. Of
#: the Stanford scans they are 3.2 to 3.5 raw spacings apart, of RGB-D frames 9 and more.
DENSE, EVEN = 5.0, 3.0


class Orient(Enum):
    """Which way normals point.

    `auto` takes what the scan knows: its view direction, else its view point, else `fold`.
    `estimated` asks `mvreg.surface.sensor.estimated_sensor` before it folds. `direction` and
    `point` ask for the one; `origin` is towards the scan's coordinate origin, as in the lab's
    published code; `fold` leaves the signs undetermined, and the stages then compare normals
    without their sign.
    """

    auto = "auto"
    estimated = "estimated"
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
    sensor = _sensor(scan, mode)
    if sensor is None:
        return normals, False
    return orient_towards(normals, points, sensor), True


def orient_towards(normals: Array, points: Array, sensor: SensorModel) -> Array:
    """Turn normals (K, ..., 3) at points (K, 3) towards a sensor."""
    towards = sensor.towards(points).reshape(len(points), *([1] * (normals.ndim - 2)), 3)
    away = (normals * towards).sum(axis=-1, keepdims=True) < 0
    return np.where(away, -normals, normals)


def _sensor(scan: Scan, mode: Orient) -> SensorModel | None:
    """The sensor that normals are turned towards; None to leave them as they are."""
    if mode is Orient.origin:
        return SensorModel(None, np.zeros(3))
    if mode is Orient.fold:
        return None
    if mode is Orient.direction:
        return None if scan.view_direction is None else SensorModel(scan.view_direction, None)
    if mode is Orient.point:
        return None if scan.view_point is None else SensorModel(None, scan.view_point)
    return sensor_of(scan) if mode is Orient.estimated else told_sensor(scan)


def align(normals: Array, points: Array, features: Features) -> Array:
    """Turn normals (N, 3) at `points` (N, 3) to the side of the nearest keypoint's normal.

    For scans that know no sensor, while their keypoints' normals have signs that mean something.
    """
    if len(features.keypoints) == 0:
        return normals
    _, closest = nearest(build_tree(features.keypoints), points)
    facing = features.normals[closest, 0]
    return np.where((normals * facing).sum(axis=1, keepdims=True) < 0, -normals, normals)


def facing_normals(scan: Scan, points: Array, features: Features, spacing: float = 0.0) -> Array:
    """Unit normals at `points` (N, 3) of a scan, towards its sensor or as its keypoints' point.

    `spacing` (length) is that of the points, see `estimate_normals`.
    """
    normals = estimate_normals(scan, points, Orient.auto, spacing=spacing)
    if not features.oriented or scan.knows_sensor:
        return normals
    sensor = estimated_sensor(scan) if len(features.keypoints) else None
    if sensor is not None:
        facing = (sensor.towards(features.keypoints) * features.normals[:, 0]).sum(axis=1) >= 0
        if facing.mean() > TURNED:  # the keypoints' were turned towards it
            return orient_towards(normals, points, sensor)
    return align(normals, points, features)


def estimate_normals(
    scan: Scan, points: Array, mode: Orient, neighbours: int = 20, spacing: float = 0.0
) -> Array:
    """Unit normals at `points` (N, 3) from the raw scan's `neighbours` nearest points (PCA).

    Twenty neighbours reach about two and a half spacings. Where that is much less than the
    `spacing` (length) of the `points`, they would be told by noise: the means of the raw points in
    cells of a third of it serve as neighbours then. Undetermined signs stay as they come; a point
    with fewer than three neighbours gets some unit vector.
    """
    even = spacing > DENSE * scan.spacing
    tree = build_tree(Cells(scan.points, spacing / EVEN).means) if even else scan.tree
    normals = plane_normals(tree, points, neighbours)
    return orient(normals, points, scan, mode)[0]
