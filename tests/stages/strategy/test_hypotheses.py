"""Loops of hypotheses: what agrees is joined, what has a rival is not."""

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.stages.strategy.best_first.agreement import (
    APART,
    CHANCE,
    CHANCE_OF_RIVALS,
    Agreement,
    Bundle,
    Hypothesis,
    against,
)
from mvreg.stages.strategy.best_first.closing import closing_pair
from mvreg.stages.strategy.best_first.hypotheses import LEAST_PROBABILITY, Hypotheses, distinct
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.testing import blob_scans, blob_views

VIEWS = blob_views(4)
TRUTH = blob_scans(4).poses


def true(source, target, *wrong):
    """``T_target_source``, turned by vectors (6,) before."""
    motion = se3.invert(TRUTH[VIEWS[target].name]) @ TRUTH[VIEWS[source].name]
    for twist in wrong:
        motion = se3.exp(np.array(twist, dtype=float)) @ motion
    return motion


HALF_TURN = (0.0, np.pi, 0.0, 0.0, 0.0, 0.0)


def known(*told):
    """Hypotheses from (source, target, probability, wrong twists)."""
    found = Hypotheses(PartialModels(VIEWS))
    for attempt, (source, target, probability, *wrong) in enumerate(told):
        found.add(source, target, [true(source, target, *wrong)], [probability], attempt)
    return found


def test_three_pairs_that_close_a_loop_agree():
    found = known((0, 1, 0.6), (1, 2, 0.6), (2, 0, 0.6)).agreements()
    assert len(found) == 1 and len(found[0].bundles) == 3
    assert found[0].odds > 1
    assert len(found[0].edges) == 2
    joined = PartialModels(VIEWS)
    for edge in found[0].edges:
        joined.join(edge.source, edge.target, edge.T_target_source)
    np.testing.assert_allclose(joined.relative(0, 2), true(2, 0), atol=1e-6)


def test_the_odds_are_those_of_two_wrong_pairs_that_fit_by_chance():
    p = 0.6
    (one,) = known((0, 1, p), (1, 2, p), (2, 0, p)).agreements()
    wrong = CHANCE * (3 * (1 - p) ** (2 * APART) * p + (1 - p) ** (3 * APART))
    assert one.odds == pytest.approx(p**3 / wrong)


@pytest.mark.parametrize("wrong", [HALF_TURN, (0, 0, 0, 30.0, 0, 0)])
def test_a_loop_that_does_not_close_is_no_agreement(wrong):
    assert known((0, 1, 0.9), (1, 2, 0.9), (2, 0, 0.9, wrong)).agreements() == []


def test_two_pairs_between_partial_models_agree():
    found = known((0, 2, 0.5), (1, 3, 0.5))
    found.models.join(1, 0, true(1, 0))
    found.models.join(3, 2, true(3, 2))
    (one,) = found.agreements()
    assert len(one.bundles) == 1 and len(one.bundles[0].members) == 2
    assert one.odds == pytest.approx(0.25 / (0.5 * CHANCE_OF_RIVALS))


def test_what_is_in_one_partial_model_already_says_nothing():
    found = known((0, 1, 0.5))
    found.models.join(1, 0, true(1, 0))
    assert found.bundles() == {}


def test_a_pair_that_contradicts_lowers_the_odds():
    told = [(0, 2, 0.5), (1, 3, 0.5), (0, 3, 0.8, HALF_TURN)]
    alone, contradicted = known(*told[:2]), known(*told)
    for found in (alone, contradicted):
        found.models.join(1, 0, true(1, 0))
        found.models.join(3, 2, true(3, 2))
    best = contradicted.agreements()[0]
    assert best.odds == pytest.approx(0.2 * alone.agreements()[0].odds)


def test_many_pairs_that_agree_weakly_are_not_taken_for_independent():
    members = tuple(Hypothesis(k, k + 10, np.eye(4), 0.15, k) for k in range(6))
    bundle = Bundle((0, 1), np.eye(4), members, ())
    assert bundle.right / bundle.wrong == pytest.approx(0.15**2 / (0.85 * CHANCE_OF_RIVALS))


def test_two_pairs_of_the_same_places_are_wrong_together():
    for pairs in (((0, 10), (0, 11)), ((0, 10), (1, 11))):
        members = tuple(Hypothesis(*pair, np.eye(4), 0.85) for pair in pairs)
        odds = Agreement((Bundle((0, 1), np.eye(4), members, ()),)).odds
        assert odds == pytest.approx(0.85**2 / (0.15 * CHANCE_OF_RIVALS))
        assert odds < 0.95 / 0.05


def test_one_of_the_poses_of_an_attempt_is_right_at_most():
    found = Hypotheses(PartialModels(VIEWS))
    kept = found.add(0, 1, [true(0, 1), true(0, 1, HALF_TURN)], [0.9, 0.9])
    assert [one.probability for one in kept] == pytest.approx([9 / 19] * 2)
    assert {one.chance for one in kept} == {CHANCE_OF_RIVALS}
    assert found.add(1, 2, [true(1, 2)], [LEAST_PROBABILITY / 2]) == []
    assert found.add(1, 2, [true(1, 2)], [1.0])[0].probability < 1


def test_a_symmetric_object_has_two_answers_and_each_is_against_the_other():
    found = Hypotheses(PartialModels(VIEWS))
    for attempt, (a, b) in enumerate([(0, 1), (1, 2), (2, 0)]):
        # Half a turn in the common frame, so that loops close whichever each pair takes.
        turn = TRUTH[VIEWS[b].name]
        turned = se3.invert(turn) @ se3.exp(np.array(HALF_TURN)) @ turn @ true(a, b)
        found.add(a, b, [true(a, b), turned], [0.9, 0.9], attempt)
    loops = found.agreements()
    assert len(loops) == 4
    for one in loops:
        assert against(one, loops) == pytest.approx(one.odds)


def test_poses_that_are_nearly_the_same_count_once():
    near = true(0, 1, (0.001, 0, 0, 0, 0, 0))
    assert distinct(VIEWS[0], [true(0, 1), near, true(0, 1, HALF_TURN)]) == [0, 2]


def test_the_pair_that_closes_a_loop_is_named():
    found = known((0, 1, 0.6))
    (new,) = found.known
    assert closing_pair(found, new, {frozenset((0, 1))}) is None
    found.models.join(2, 1, true(2, 1))
    assert closing_pair(found, new, {frozenset((0, 1))}) == (0, 2)
    assert closing_pair(found, new, {frozenset((0, 1)), frozenset((0, 2))}) is None


def test_a_third_view_closes_a_triangle():
    found = known((0, 1, 0.6), (1, 2, 0.6))
    pair = closing_pair(found, found.known[1], {frozenset((0, 1)), frozenset((1, 2))})
    assert pair is not None and frozenset(pair) == frozenset((0, 2))


def test_what_can_slide_is_a_rival_of_what_cannot():
    found = Hypotheses(PartialModels(VIEWS))
    poses = [true(0, 1), true(0, 1, HALF_TURN)]
    (alone,) = found.add(0, 1, poses, [0.99, 0.0])
    (beside,) = found.add(0, 1, poses, [0.99, 0.0], 1, [0.99, 0.99])
    assert alone.probability > 0.9 and alone.chance == CHANCE
    assert beside.probability < 0.51 and beside.chance == CHANCE_OF_RIVALS


def test_the_most_probable_pose_is_no_more_so_than_the_judge_is_confident():
    found = Hypotheses(PartialModels(VIEWS))
    (sure,) = found.add(0, 1, [true(0, 1)], [0.9], confidence=0.9)
    assert sure.probability == pytest.approx(0.9) and sure.chance == CHANCE
    (doubted,) = found.add(0, 1, [true(0, 1)], [0.9], confidence=0.7)
    assert doubted.probability == pytest.approx(0.7) and doubted.chance == CHANCE_OF_RIVALS


def test_a_loop_of_halls_that_look_alike_is_not_certain():
    (one,) = known((0, 1, 0.82), (1, 2, 0.94), (2, 0, 0.8)).agreements()
    assert one.odds < 0.95 / 0.05
    (one,) = known((0, 1, 0.9), (1, 2, 0.92), (2, 0, 0.9)).agreements()
    assert one.odds > 0.95 / 0.05
