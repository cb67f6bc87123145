"""Returns at the largest range are found, wherever the scan lies, and taken for no surface."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.datasets.environments.instruments import Panorama
from mvreg.datasets.environments.sets import PHASE_SCANNER, Desk, Room
from mvreg.evaluation.assess import assess
from mvreg.geometry import se3
from mvreg.surface.largest_range import (
    at_largest_range,
    remark_on_largest_range,
    without_largest_range,
)
from mvreg.testing.scans import blob_scans, sphere_directions
from mvreg.types import Result, Scan

LARGEST = 30.0
MOTION = se3.random(np.random.default_rng(3), 20.0)


def room_scan(extra: np.ndarray, at: float = 2.0, sensor: bool = True) -> Scan:
    """A room seen from within, and some other points, all about the scanner; these come last."""
    pose = se3.from_parts(np.eye(3), np.array([at, 3.0, 1.5]))
    rng = np.random.default_rng(round(10 * at))
    seen = Panorama(rays=9000, error=PHASE_SCANNER)(Room().scene(), pose, rng)
    origin = np.zeros(3) if sensor else None
    return Scan(f"room_{at}", np.concatenate([seen, extra]), view_point=origin)


def no_returns(count: int, noise: float = 0.002) -> np.ndarray:
    """Points on the upper half of a sphere about the scanner."""
    rng = np.random.default_rng(1)
    directions = sphere_directions(2 * count)[-count:] * [1, 1, -1]
    return directions * (LARGEST + noise * rng.normal(size=(count, 1)))


@pytest.mark.parametrize("sensor", [True, False])
@pytest.mark.parametrize("motion", [np.eye(4), MOTION])
def test_they_are_found_all_and_none_besides(sensor, motion):
    scan = room_scan(no_returns(200), sensor=sensor).moved(motion)
    found = at_largest_range(scan)
    assert found[-200:].all() and not found[:-200].any()
    left = without_largest_range(scan)
    np.testing.assert_array_equal(left.points, scan.points[:-200])
    assert left.name == scan.name and left.knows_sensor is sensor


def test_an_estimate_that_is_off(monkeypatch):
    scan = room_scan(no_returns(200), sensor=False)
    from mvreg.surface import sensor
    from mvreg.surface.sensor import SensorModel

    for off, count in ((1.0, 200), (12.0, 0)):
        wrong = SensorModel(None, np.array([off, -off / 2, 0.0]))
        monkeypatch.setattr(sensor, "estimated_sensor", lambda scan, wrong=wrong: wrong)
        assert at_largest_range(replace(scan)).sum() == count


@pytest.mark.parametrize(
    "extra",
    [
        np.zeros((0, 3)),
        no_returns(30),
        no_returns(400, noise=1.0),
        no_returns(400) * np.random.default_rng(0).uniform(0.5, 1.0, size=(400, 1)),
        # A small board, straight ahead and far away: as flat as it is round.
        np.column_stack([np.random.default_rng(0).uniform(-0.5, 0.5, (400, 2)), np.full(400, 30)]),
    ],
    ids=["nothing", "few", "a cloud", "a deep scene", "a board"],
)
def test_what_is_none(extra):
    scan = room_scan(extra)
    assert not at_largest_range(scan).any()
    assert without_largest_range(scan) is scan


def test_scans_of_other_kinds():
    rng = np.random.default_rng(0)
    for scan in (*blob_scans(2).scans, *Desk(scans=2)(rng).scans):
        assert not at_largest_range(scan).any()
    sphere = Scan("sphere", sphere_directions(500), view_point=np.zeros(3))
    assert not at_largest_range(sphere).any()  # else nothing would be left


def test_registration_does_without_and_says_so():
    scans = [room_scan(no_returns(200), 2.0), room_scan(no_returns(0), 3.0)]
    views = mvreg.prepare(scans)
    assert [len(view.scan.points) for view in views] == [
        len(scans[0].points) - 200, len(scans[1].points),
    ]  # fmt: skip
    assert max(np.linalg.norm(view.points, axis=1).max() for view in views) < 12
    (remark,) = remark_on_largest_range(scans)
    assert remark.startswith("left 200 points out") and "in 1 of 2 scans (room_2.0);" in remark
    poses = {view.name: np.eye(4) for view in views}
    assert assess(Result(views[0].name, poses, (), (), views=tuple(views)), scans).scans
