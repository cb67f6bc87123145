"""Kinds of sets in code: what is counted as together, right and false."""

import numpy as np
import pytest

from experiments.accuracy.kinds import Count, add, scans_of, together
from experiments.accuracy.kinds_fragments import fused
from mvreg.geometry import se3
from mvreg.types import Result


@pytest.fixture(scope="module")
def scans():
    return scans_of("tool", 0)


def result(scans, wrong=()):
    """A result with the true poses, but for scans that are `wrong`."""
    away = se3.exp(np.array([0, 0, np.pi / 2, 0, 0, 0]))
    poses = {name: away @ T if name in wrong else T for name, T in scans.poses.items()}
    first = next(iter(poses))
    frame = se3.invert(poses[first])
    return Result(first, {name: frame @ T for name, T in poses.items()}, (), ())


def counted(scans, found):
    count = Count()
    add(count, scans, found, resolution=1.0)
    return count


def test_a_tool_is_another_for_every_draw_and_moved_at_random(scans):
    again, other = scans_of("tool", 0), scans_of("tool", 1)
    assert len(scans.scans) == 12 and scans.scans[0].view_point is None
    np.testing.assert_array_equal(scans.scans[0].points, again.scans[0].points)
    assert other.scans[0].name != scans.scans[0].name


def test_true_poses_are_right_and_a_turned_scan_is_false(scans):
    count = counted(scans, result(scans))
    assert (count.scans, count.together, count.right, count.false) == (12, 12, 12, 0)
    last = list(scans.poses)[-1]
    count = counted(scans, result(scans, {last}))
    assert (count.together, count.right, count.false) == (11, 11, 1)


def test_counts_add_up_but_for_the_highest_confidence():
    total = together([Count(scans=3, highest=0.9), Count(scans=4, highest=0.5, false=1)])
    assert (total.scans, total.false, total.highest) == (7, 1, 0.9)


def test_fragments_keep_the_mean_of_what_was_seen_often():
    often = np.array([[0.1, 0.1, 0.1], [0.2, 0.2, 0.2], [0.3, 0.3, 0.3]])
    stray = np.array([[5.5, 5.5, 5.5]])
    np.testing.assert_allclose(fused([often, stray], 1.0), [[0.2, 0.2, 0.2]])
