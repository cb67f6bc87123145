"""A second look at a refused attempt finds the pose that evidence prefers."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.run import load_method
from mvreg.stages.strategy.best_first.second_look import looked_at_again, weighed, with_answers
from mvreg.testing import blob_scans, blob_views
from mvreg.types import Pair, Verdict

VIEWS = blob_views(3)
PIPELINE = load_method("auto").pipeline


def true():
    truth = blob_scans(3).poses
    return se3.invert(truth[VIEWS[0].name]) @ truth[VIEWS[1].name]


def attempt(*alternatives):
    """A wrong registration of the second view to the first, with other poses beside it."""
    wrong = se3.exp(np.array([0, 0, 2.0, 0, 0, 0])) @ true()
    found = PIPELINE.refine(VIEWS[1], VIEWS[0], wrong)
    return replace(found, T_target_source=wrong, alternatives=np.array(alternatives))


def look(registration):
    found, likely, plausible = looked_at_again(PIPELINE, registration, VIEWS[1], VIEWS[0])
    assert all(one <= other for one, other in zip(likely, plausible, strict=True))
    return found, likely


def test_the_right_pose_among_the_alternatives_is_found():
    near = se3.exp(np.array([0.03, 0, 0, 0, 0, 0])) @ true()
    found, likely = look(attempt(near))
    best = int(np.argmax(likely))
    assert best > 0 and likely[best] > 0.95
    assert np.rad2deg(se3.rotation_angle(found[best].T_target_source, true())) < 2
    assert (
        likely[0]
        == weighed(PIPELINE.judge, VIEWS[1], VIEWS[0], found[0].T_target_source).probability
        < 0.5
    )


def test_poses_that_are_alike_are_looked_at_once():
    found, likely = look(attempt(true(), true(), true()))
    assert len(found) == len(likely)
    apart = [se3.rotation_angle(one.T_target_source, true()) for one in found]
    assert sum(np.rad2deg(angle) < 2 for angle in apart) == 1


def test_what_contradicts_the_surfaces_is_not_refined():
    wrongs = [se3.exp(np.array([0, k, 0.5, 0, 0, 0])) @ true() for k in (1.0, 2.0, 3.0)]
    found, likely = look(attempt(*wrongs))
    assert len(found) == 1 and likely[0] < 0.5


def test_a_refused_attempt_tells_the_poses_that_it_leaves():
    one, other, third = (
        replace(attempt(true()), T_target_source=pose)
        for pose in (true(), se3.exp(np.array([np.pi, 0, 0, 0, 0, 0])) @ true(), np.eye(4))
    )
    pair = Pair("b", "a", Verdict(False, 0.5, 0.05, "ambiguous: another pose is as probable"))
    told = with_answers(pair, VIEWS[1], [other, one, third], [0.98, 0.99, 0.02], [0.98, 0.99, 0.02])
    first, second = told.answers
    np.testing.assert_array_equal(first.T_target_source, one.T_target_source)
    assert (first.apart, first.confidence) == (0.0, pytest.approx(99 / 149.02, abs=1e-3))
    assert second.confidence == pytest.approx(49 / 149.02, abs=1e-3)
    assert second.apart > VIEWS[1].scale.spacing
    assert with_answers(pair, VIEWS[1], [one, third], [0.98, 0.02], [0.98, 0.02]) is pair
    sure = replace(pair, verdict=replace(pair.verdict, reliable=True))
    assert with_answers(sure, VIEWS[1], [one, other], [0.9, 0.9], [0.9, 0.9]) is sure
