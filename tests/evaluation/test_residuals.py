"""Residuals of points under the poses of a result."""

from __future__ import annotations

import numpy as np

import mvreg
from mvreg.evaluation.residuals import of_raw_points, point_residuals
from mvreg.geometry import se3
from mvreg.geometry.nearest import nearest
from mvreg.types import Scan


def plane(name, x, height=0.0):
    """A sheet of unit spacing from x to x + 20, seen from above."""
    grid = np.stack(np.meshgrid(np.arange(x, x + 20.0), np.arange(20.0)), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.full(len(grid), height)])
    return Scan(name, points, view_direction=np.array([0.0, 0.0, 1.0]))


def test_that_residuals_are_distances_from_the_other_surfaces():
    scans = [plane("a", 0), plane("b", 10, 0.3), plane("c", 100), plane("d", 10, 0.4)]
    views = mvreg.prepare(scans, changes={"downsample": "voxel"})
    shift = se3.from_parts(np.eye(3), np.array([5.0, 6.0, 7.0]))
    poses = dict.fromkeys("abcd", shift)
    found = point_residuals(poses, views)
    assert np.isnan(found["c"]).all()
    a = views[0].points[:, 0]
    np.testing.assert_allclose(
        found["a"][a > 13], np.sqrt((0.3**2 + 0.4**2) / 2), rtol=1e-6
    )  # b and d are over it
    assert np.isnan(found["a"][a < 4]).all()
    alone = point_residuals({"a": shift, "c": shift}, views)
    assert np.isnan(alone["a"]).all() and "b" not in alone
    distances, indices = nearest(views[0].tree, scans[0].points)
    raw = of_raw_points(found["a"], indices, distances, views[0])
    assert len(raw) == 400
    np.testing.assert_allclose(raw[scans[0].points[:, 0] > 14], np.sqrt(0.125), rtol=1e-6)


def test_that_nothing_is_known_of_points_far_from_the_view():
    (view,) = mvreg.prepare([plane("a", 0), plane("b", 0)], changes={"downsample": "voxel"})[:1]
    distances, indices = nearest(view.tree, np.array([[500.0, 0, 0]]))
    far = of_raw_points(np.zeros(len(view.points)), indices, distances, view)
    assert np.isnan(far).all()
