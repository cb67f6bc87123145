"""Where the sensor of a silent scan was: within a few degrees, in any frame, or not at all."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.geometry import se3
from mvreg.surface.range_image import RangeImage, Sensor, estimated_direction
from mvreg.surface.sensor_direction import hidden_share, side
from mvreg.testing import blob_scans, blob_views
from mvreg.testing.views import AXES_SWAPPED, MOTION, moved_view, pipeline, scaled_view
from mvreg.types import Scan


def off(found, truth):
    """The angle between two directions, degrees."""
    return np.rad2deg(np.arccos(np.clip(found @ truth, -1, 1)))


def silent(view):
    return replace(view, scan=Scan(view.name, view.scan.points))


@pytest.mark.parametrize("index", [0, 1, 2])
def test_the_direction_is_told_to_a_few_degrees_whatever_the_signs_of_the_normals(index):
    view = blob_views()[index]
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(len(view.points), 1))
    found = estimated_direction(replace(silent(view), normals=view.normals * signs))
    assert off(found, view.scan.view_direction) < 10
    assert np.linalg.norm(found) == pytest.approx(1)


@pytest.mark.parametrize("motion", [MOTION, AXES_SWAPPED])
def test_the_frame_and_the_unit_hardly_matter(motion):
    view = silent(blob_views()[0])
    found = estimated_direction(view)
    assert off(motion[:3, :3] @ found, estimated_direction(moved_view(view, motion))) < 2
    np.testing.assert_allclose(estimated_direction(scaled_view(view, 1024.0)), found, atol=1e-12)


def test_what_was_seen_from_all_around_has_no_direction():
    scans = blob_scans(9)
    points = np.concatenate([se3.apply(scans.poses[s.name], s.points) for s in scans.scans])
    scan = Scan("all", points)
    view = pipeline().prepare([scan, replace(scan, name="again")], np.random.default_rng(0))[0]
    assert estimated_direction(view) is None
    assert RangeImage.of(view, Sensor.estimated) is None


def test_a_point_is_hidden_by_another_in_front_of_it():
    grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [0.0]), -1).reshape(-1, 3)
    up, landmark = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
    assert hidden_share(grid, up, 2.0, landmark) == 0
    behind = grid[:50] - [0, 0, 100.0]
    both = np.concatenate([grid, behind])
    assert hidden_share(both, up, 2.0, landmark) == pytest.approx(1 / 3)
    assert hidden_share(both, -up, 2.0, landmark) == pytest.approx(1 / 3)
    near = grid[:50] - [0, 0, 3.0]
    assert hidden_share(np.concatenate([grid, near]), up, 2.0, landmark) == 0


def test_a_cap_bulges_towards_its_sensor():
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(500, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    up = np.array([0.0, 0, 1])
    assert side(10 * normals, normals, up) == 1
    assert side(10 * normals, -normals, up) == 1
    assert side(10 * normals, normals, -up) == -1


def test_too_few_points_tell_nothing():
    view = silent(blob_views()[0])
    few = replace(view, points=view.points[:10], normals=view.normals[:10])
    assert estimated_direction(few) is None


@pytest.mark.parametrize("shape", ["gnome", "sphere"])
def test_of_a_perspective_camera_it_is_the_middle_of_the_rays(shape):
    scans = mvreg.dataset("figurine", shape=shape, views=2, points=8000).scans
    views = pipeline().prepare([Scan(s.name, s.points) for s in scans], np.random.default_rng(0))
    for scan, view in zip(scans, views, strict=True):
        truth = scan.view_point - scan.points.mean(axis=0)
        assert off(estimated_direction(view), truth / np.linalg.norm(truth)) < 10


def test_the_bunny_s_sensor_is_found(data_root):
    scans = mvreg.dataset("bunny").scans
    bare = [Scan(scan.name, scan.points) for scan in scans]
    views = mvreg.load_method("fcpma").pipeline.prepare(bare, np.random.default_rng(0))
    errors = [off(estimated_direction(view), np.array([0.0, 0, 1])) for view in views]
    assert max(errors) < 12
    assert np.median(errors) < 9
