"""Where a sensor was, by the density of the points alone: near, far, or not to be told."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.geometry import se3
from mvreg.surface.normals import Orient, orient
from mvreg.surface.range_image import RangeImage, Sensor
from mvreg.surface.sensor import SensorModel, estimated_sensor, told_sensor
from mvreg.surface.sensor_position import hidden_from, residuals, sampled, spread
from mvreg.testing import blob_scans
from mvreg.testing.views import MOTION
from mvreg.types import Scan


def scans_of(name):
    """Two scans of an embedded scene, whose sensor is at their origin."""
    return mvreg.dataset(name, scans=4).scans[1:3]


def silent(scan, motion=None):
    """The scan in another frame, and nothing told of its sensor."""
    moved = scan if motion is None else scan.moved(motion)
    return replace(moved, view_point=None, view_direction=None)


def size(scan):
    return float(np.linalg.norm(np.ptp(scan.points, axis=0)))


@pytest.mark.parametrize("name", ["room", "desk", "street"])
def test_a_near_sensor_is_found_within_a_few_per_cent(name):
    for scan in scans_of(name):
        found = estimated_sensor(silent(scan))
        assert found.direction is None
        assert np.linalg.norm(found.point) < 0.06 * size(scan)


def test_a_scanner_on_open_ground_is_found_above_it():
    for scan in mvreg.dataset("yard", scans=4).scans:
        low = scan.chosen(scan.points[:, 2] < 1.0)  # the ground, and the feet of the walls
        found = estimated_sensor(silent(low))
        assert found.direction is None
        assert np.linalg.norm(found.point) < 0.03 * size(low)


def test_the_estimate_moves_with_the_scan():
    scan = scans_of("desk")[0]
    here, there = (estimated_sensor(silent(scan, motion)) for motion in (None, MOTION))
    moved = se3.apply(MOTION, here.point[None])[0]
    assert np.linalg.norm(moved - there.point) < 0.05 * size(scan)


def test_a_far_sensor_is_a_direction():
    scan = blob_scans(3).scans[0]
    found = estimated_sensor(silent(scan))
    assert found.point is None
    assert np.rad2deg(np.arccos(found.direction @ scan.view_direction)) < 12


def test_what_no_single_sensor_saw_has_none():
    scans = blob_scans(9)
    points = np.concatenate([se3.apply(scans.poses[s.name], s.points) for s in scans.scans])
    assert estimated_sensor(Scan("fused", points)) is None


def test_too_few_points_say_nothing():
    assert estimated_sensor(Scan("few", np.random.default_rng(0).normal(size=(24, 3)))) is None
    assert sampled(Scan("few", np.random.default_rng(0).normal(size=(24, 3)))) is None


def test_an_even_thinning_says_nothing():
    """A voxel grid has taken away what told of the sensor."""
    scan = scans_of("room")[0]
    cells = np.unique(np.floor(scan.points / 0.1), axis=0)
    assert estimated_sensor(Scan("thinned", 0.1 * cells)) is None


def test_densities_are_explained_by_the_true_position_alone():
    own = sampled(silent(scans_of("room")[0]))
    true, beside = (float(spread(residuals(np.array(p), own))) for p in ([0.0] * 3, [1.5, 1.0, 0]))
    assert true < 0.4 * beside


def test_points_behind_others_are_hidden_from_a_position():
    grid = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), [10.0]), -1).reshape(-1, 3)
    behind = grid * 2.0
    assert hidden_from(grid, np.zeros(3)) == 0
    assert hidden_from(np.concatenate([grid, behind]), np.zeros(3)) == pytest.approx(0.5, abs=0.15)


def test_what_the_scan_says_comes_first():
    point, direction = np.array([1.0, 2, 3]), np.array([0.0, 0, 1])
    points = np.eye(3)
    assert told_sensor(Scan("bare", points)) is None
    assert np.array_equal(told_sensor(Scan("near", points, view_point=point)).point, point)
    far = told_sensor(Scan("far", points, view_point=point, view_direction=direction))
    assert np.array_equal(far.direction, direction) and far.point is None


def test_directions_towards_a_sensor():
    points = np.array([[0.0, 0, 0], [0, 3, 0]])
    assert np.array_equal(SensorModel(np.array([0.0, 0, 1]), None).towards(points)[1], [0, 0, 1])
    near = SensorModel(None, np.array([4.0, 0, 0])).towards(points)
    np.testing.assert_allclose(near, [[1, 0, 0], [0.8, -0.6, 0]], atol=1e-15)


def test_normals_turn_towards_an_estimated_sensor_only_if_asked():
    scan = scans_of("room")[0]
    normals = np.random.default_rng(0).normal(size=(len(scan.points), 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    known, oriented = orient(normals, scan.points, scan, Orient.auto)
    found, turned = orient(normals, scan.points, silent(scan), Orient.estimated)
    assert oriented and turned
    assert ((known * found).sum(axis=1) > 0).mean() > 0.9
    assert not orient(normals, scan.points, silent(scan), Orient.auto)[1]


def test_the_range_image_of_a_silent_scan_is_from_the_estimated_position():
    view = mvreg.prepare([silent(scan) for scan in scans_of("room")])[0]
    assert RangeImage.of(view, Sensor.known) is None
    image = RangeImage.of(view, Sensor.estimated)
    assert image.direction is None and np.linalg.norm(image.origin) < 0.5
    assert view.features.oriented
