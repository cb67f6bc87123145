"""Something thin that looks the same turned over: front and back are told apart, or not placed."""

from functools import cache

import numpy as np

import mvreg
from experiments.accuracy.sides import Scissors
from mvreg.geometry import se3
from mvreg.stages.refine.planes import PointToPlane
from mvreg.stages.strategy.best_first.joint_verdict import (
    MOST_OTHER_SIDE,
    checked_for_other_side,
)
from mvreg.stages.strategy.best_first.other_side import fits_turned_over, other_side
from mvreg.testing.views import degenerate_pairs, overlap, registration
from mvreg.types import Verdict

#: What turns the scissors over, in the world: half a turn about their long axis.
TURNED_OVER = np.diag([-1.0, 1.0, -1.0, 1.0])
RELIABLE = Verdict(True, 0.001, 0.05, "surfaces, normals and free space agree", 0.999)


@cache
def scissors():
    """Views of scissors 3 mm thick by name, and ``T_world_scan``."""
    scans = Scissors(thickness=3.0)(np.random.default_rng(0))
    chosen = [scan for scan in scans.scans if scan.name in ("front_00", "front_03", "back_09")]
    return {view.name: view for view in mvreg.prepare(chosen)}, scans.poses


def found(source, target, turn=None):
    """The registration of two views from where they belong, or turned over."""
    views, poses = scissors()
    turn = np.eye(4) if turn is None else turn
    start = se3.invert(poses[target]) @ turn @ poses[source]
    return PointToPlane()(views[source], views[target], start), views[source], views[target]


def test_two_scans_of_one_side_show_one_side():
    one, source, target = found("front_03", "front_00")
    assert other_side(one, source, target) < 0.1
    assert checked_for_other_side(source, target)(one, RELIABLE) is RELIABLE


def test_the_back_on_the_front_is_ambiguous():
    one, source, target = found("back_09", "front_00", TURNED_OVER)
    assert other_side(one, source, target) > 0.9
    verdict = checked_for_other_side(source, target)(one, RELIABLE)
    assert not verdict.reliable
    assert verdict.confidence < 1 - MOST_OTHER_SIDE
    assert verdict.reason.startswith("ambiguous: ")


def letter_z():
    """A view of a flat Z, which is not its own mirror image."""
    rng = np.random.default_rng(0)
    across, along = rng.uniform(0, 60, (3, 1500)), rng.uniform(-2, 2, (3, 1500))
    bottom = np.stack([across[0], along[0]])
    top = np.stack([across[1], 80 + along[1]])
    bar = np.stack([across[2], 80 / 60 * across[2] + along[2]])
    flat = np.concatenate([bottom, top, bar], axis=1).T
    return mvreg.Scan("z", np.column_stack([flat, 0.02 * rng.standard_normal(len(flat))]))


def test_what_is_not_thin_or_not_its_own_mirror_image_is_not_asked():
    views, _ = scissors()
    front = views["front_00"]
    assert fits_turned_over(front)
    assert not fits_turned_over(overlap().source), "a blob"
    z, _ = mvreg.prepare([letter_z(), front.scan])
    assert not fits_turned_over(z)


def test_views_that_show_nothing_are_no_error():
    for source, target in degenerate_pairs().values():
        assert 0 <= other_side(registration(source, target, np.eye(4)), source, target) <= 1
