"""Poses between levelled frames."""

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.geometry.vertical import levelled, tilt

UP = np.array([0.0, 0.0, 1.0])


def turned(vector, degrees):
    return se3.exp(np.append(np.radians(degrees) * np.array(vector, dtype=float), np.zeros(3)))


def test_tilt_is_that_of_the_vertical_alone():
    poses = np.array([np.eye(4), turned(UP, 130), turned([1, 0, 0], 4), turned([0, 1, 0], -170)])
    np.testing.assert_allclose(tilt(poses, UP, UP), [0, 0, 4, 170], atol=1e-9)
    frame = se3.random(np.random.default_rng(0), 3.0)
    other = frame[:3, :3] @ UP
    np.testing.assert_allclose(tilt(frame @ poses, UP, other), [0, 0, 4, 170], atol=1e-9)


@pytest.mark.parametrize("most", [0.0, 2.0])
def test_levelled_poses_keep_the_middle_and_the_rest_of_the_turn(most):
    rng = np.random.default_rng(1)
    level = turned(UP, 70) @ se3.from_parts(np.eye(3), rng.normal(size=3))
    centre = rng.normal(size=3)
    at = se3.apply(level, centre[None])[0]
    tilted = se3.about(at, turned([0.6, 0.8, 0], 5)) @ level
    poses = np.array([tilted, level])
    found = levelled(poses, UP, UP, centre, most)
    np.testing.assert_allclose(tilt(found, UP, UP), [most, 0], atol=1e-6)
    np.testing.assert_allclose(found[:, :3, :3] @ centre + found[:, :3, 3], [at, at])
    np.testing.assert_array_equal(found[1], level)
    if most == 0:
        np.testing.assert_allclose(found[0], level, atol=1e-9)
    np.testing.assert_array_equal(levelled(poses, UP, UP, centre, 5.1), poses)


def test_upside_down_is_turned_somehow():
    found = levelled(turned([1, 0, 0], 180), UP, UP, np.ones(3))
    assert tilt(found, UP, UP) == pytest.approx(0, abs=1e-6)
    np.testing.assert_allclose(found[:3, :3] @ found[:3, :3].T, np.eye(3), atol=1e-12)
