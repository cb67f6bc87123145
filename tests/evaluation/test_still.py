"""A sensor that stood still is told from one that moved, where the poses say so."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mvreg
from mvreg.datasets.environments.effects import RangeError
from mvreg.datasets.environments.instruments import DepthCamera, Panorama
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.environments.sets import Room
from mvreg.datasets.viewpoints import orbit
from mvreg.evaluation.assess import assess
from mvreg.evaluation.grade import Grade
from mvreg.evaluation.still import STOOD_STILL
from mvreg.geometry import se3
from mvreg.types import Result, Scan, View

CAMERA = DepthCamera(rays=10_000, error=RangeError(constant=0.001))
#: ``T_world_scan``, of a camera that looks into a corner of a room.
EYE = orbit(np.array([1.5, 4.5, 0.8]), 1.8, 120, 28, 0)


def seen(instrument, scene: Scene, poses, sensor: bool) -> tuple[View, ...]:
    rng = np.random.default_rng(0)
    origin = np.zeros(3) if sensor else None
    scans = [
        Scan(f"scan_{k}", instrument(scene, pose, rng), view_point=origin)
        for k, pose in enumerate(poses)
    ]
    return tuple(mvreg.prepare(scans))


@cache
def fixed_camera(sensor: bool, count: int = 5) -> tuple[View, ...]:
    return seen(CAMERA, Room().scene(), [EYE] * count, sensor)


def assessed(views, poses=None):
    placed = poses or [np.eye(4)] * len(views)
    pairs = {view.name: pose for view, pose in zip(views, placed, strict=True)}
    return assess(Result(views[0].name, pairs, (), ()), views)


@pytest.mark.parametrize("sensor", [True, False])
def test_a_camera_that_stood_still(sensor):
    found = assessed(fixed_camera(sensor))
    assert found.remarks == (STOOD_STILL,)
    assert {scan.grade for scan in found.scans.values()} == {Grade.amber}
    assert {scan.reason for scan in found.scans.values()} == {STOOD_STILL}


def test_one_that_is_far_away():
    """Sensors that are told by directions alone."""
    away = np.array([0.0, 0.0, 1.0])
    views = [
        replace(view, scan=replace(view.scan, view_point=None, view_direction=away))
        for view in fixed_camera(True)
    ]
    assert assessed(views).remarks == (STOOD_STILL,)
    swung = [se3.exp(np.array([0.1 * k, 0, 0, 0, 0, 0]))[:3, :3] @ away for k in range(5)]
    views = [
        replace(view, scan=replace(view.scan, view_direction=direction))
        for view, direction in zip(views, swung, strict=True)
    ]
    assert not assessed(views).remarks


def test_two_scans_may_well_be_of_one_place():
    assert not assessed(fixed_camera(True, 2)).remarks


def test_a_camera_that_is_moved():
    poses = [se3.from_parts(np.eye(3), np.array([0.2 * k, 0, 0])) @ EYE for k in range(4)]
    views = seen(CAMERA, Room().scene(), poses, True)
    found = assessed(views, [se3.invert(poses[0]) @ pose for pose in poses])
    assert not found.remarks
    assert {scan.grade for scan in found.scans.values()} == {Grade.green}


def test_panoramas_from_one_place():
    """All of them see the whole room: nothing was turned before the scanner."""
    at = se3.from_parts(np.eye(3), np.array([3.0, 3.0, 1.5]))
    views = seen(Panorama(rays=8000), Room().scene(), [at] * 3, True)
    assert not assessed(views).remarks
