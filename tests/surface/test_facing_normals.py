"""Signs of normals at points, where the sensor is unknown and keypoints tell its side."""

from dataclasses import replace

import numpy as np

from mvreg.surface.normals import facing_normals
from mvreg.testing import overlap
from mvreg.types import Features, Scan


def test_normals_take_the_side_of_the_nearest_keypoint():
    view = overlap().source
    blind = replace(view.scan, view_direction=None, view_point=None)
    known, points = view.features, view.points[::5]
    toward = facing_normals(view.scan, points, known)
    assert known.oriented and not blind.knows_sensor
    same = (facing_normals(blind, points, known) * toward).sum(axis=1)
    assert (same > 0.9).mean() > 0.97
    turned = replace(known, normals=-known.normals)
    other = (facing_normals(blind, points, turned) * toward).sum(axis=1)
    assert (other < -0.9).mean() > 0.97
    # The sensor counts for more than what keypoints say, and keypoints without signs say nothing.
    np.testing.assert_array_equal(facing_normals(view.scan, points, turned), toward)
    unsigned = [
        facing_normals(blind, points, replace(one, oriented=False)) for one in (known, turned)
    ]
    np.testing.assert_array_equal(*unsigned)


def test_normals_without_a_keypoint_near_stay_unit_vectors():
    scan = Scan("flat", np.random.default_rng(0).uniform(size=(200, 3)) * [1, 1, 0])
    none = Features(np.empty((0, 3)), np.empty((0, 1, 3)), np.empty((0, 4)), oriented=True)
    found = facing_normals(scan, scan.points, none)
    np.testing.assert_allclose(np.abs(found), np.tile([0.0, 0, 1], (200, 1)), atol=1e-9)
