"""The judge by evidence: probability, alternatives, loops; scans and models with parts."""

import gc
from dataclasses import replace
from weakref import ref

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.evidence.pooled import pool_evidence
from mvreg.evidence.pooling import SUBSAMPLING
from mvreg.geometry import se3
from mvreg.stages.judge.evidence import HARDLY, EvidenceJudge, odds, view_pairs
from mvreg.surface.displacement import rms_apart
from mvreg.testing import blob_scans, blob_views, overlap
from mvreg.testing.scans import blob_scan, plane_scans, sensor_pose
from mvreg.testing.views import graph_of, pipeline, registration
from mvreg.types import Model, Part, ViewGraph


def found(pose=None):
    pair = overlap()
    pose = pair.T_target_source if pose is None else pose
    return registration(pair.source, pair.target, pose)


def judged(one, *accepted, **parameters):
    pair = overlap()
    return EvidenceJudge(**parameters)(one, pair.source, pair.target, graph_of(*accepted))


def turned(degrees, pose):
    """A pose after a turn of the source about its middle."""
    middle = overlap().source.points.mean(axis=0)
    turn = se3.exp(np.array([np.deg2rad(degrees), 0, 0, 0, 0, 0]))
    return pose @ se3.from_parts(turn[:3, :3], middle - turn[:3, :3] @ middle)


def test_a_right_pose_is_reliable_and_says_how_much():
    verdict = judged(found())
    assert verdict.reliable
    assert verdict.confidence > 0.9
    assert verdict.score == pytest.approx(1 - verdict.confidence)
    assert verdict.threshold == pytest.approx(1 - EvidenceJudge().min_probability)
    assert verdict.evidence["surface_overlap"] > 0.6


def test_a_right_pose_is_not_reliable_enough_for_every_wish():
    # Slightly off, so that the probability is not one.
    pose = overlap().T_target_source.copy()
    pose[:3, 3] += 0.4 * overlap().target.scale.resolution
    confidence = judged(found(pose)).confidence
    assert 0 < confidence < 1
    wish = min(confidence + (1 - confidence) / 2, 1 - 1e-12)
    assert not judged(found(pose), min_probability=wish).reliable


def test_more_is_asked_where_no_sensor_says_what_is_free():
    pair, judge = overlap(), EvidenceJudge()
    seen = pool_evidence(view_pairs(pair.source, pair.target, pair.T_target_source))
    blind = replace(seen, sensor="none", violation=None, residual=3.0)
    assert judge.least(seen) == judge.min_probability < judge.least(blind)
    assert judge.min_probability < blind.probability < judge.min_probability_blind
    assert judge.objection(seen, 0.0) is None
    assert judge.objection(blind, 0.0) == "probability below the threshold"


def test_an_alternative_as_probable_makes_it_ambiguous():
    pose = overlap().T_target_source
    weak, strong = turned(90, pose), turned(0, pose)
    one = replace(found(), alternatives=np.array([weak]))
    assert judged(one).reliable, "an alternative that does not fit is none"
    near = replace(found(), alternatives=np.array([turned(2, pose), strong]))
    assert judged(near).reliable, "the same pose once more is no alternative"
    # The alternative is right, and clearly different from what was found.
    other = replace(found(weak), alternatives=np.array([pose]))
    verdict = judged(other)
    assert not verdict.reliable
    assert verdict.reason.startswith("ambiguous")
    assert verdict.confidence < 0.5


def test_a_subsample_at_an_alternative_tells_what_a_whole_one_does():
    pair, judge = overlap(), EvidenceJudge()
    for degrees, likely in ((0, True), (1, True), (25, False), (90, False)):
        pose = turned(degrees, pair.T_target_source)
        whole = pool_evidence(view_pairs(pair.source, pair.target, pose))
        subsampled = pool_evidence(view_pairs(pair.source, pair.target, pose, SUBSAMPLING))
        assert subsampled.plausibility == pytest.approx(whole.plausibility, abs=0.05)
        assert subsampled.points == pytest.approx(whole.points, rel=0.2, abs=5 * SUBSAMPLING)
        told = judge.likelihood(pair.source, pair.target, pose, whole)
        assert told == pytest.approx((whole if likely else subsampled).plausibility)


def test_an_alternative_with_far_more_violations_is_less_probable(monkeypatch):
    pair, judge = overlap(), EvidenceJudge()
    pose = pair.T_target_source
    there = pool_evidence(view_pairs(pair.source, pair.target, pose))
    floating = replace(there, violation=0.05)  # probable by itself
    assert floating.probability > 0.9
    assert there.log_odds_over(floating) == pytest.approx(-floating.log_odds_over(there))
    assert there.log_odds_over(floating) > np.log(100)
    few = replace(there, points=200), replace(floating, points=200)
    assert few[0].log_odds_over(few[1]) < there.log_odds_over(floating)
    told = judge.likelihood(pair.source, pair.target, pose, floating)
    assert told == there.plausibility, "the better one loses nothing"
    assert there.violation <= HARDLY
    monkeypatch.setattr("mvreg.stages.judge.evidence.pool_evidence", lambda pairs: floating)
    beside = odds(there.probability) / np.exp(there.log_odds_over(floating))
    told = judge.likelihood(pair.source, pair.target, pose, there)
    assert told == pytest.approx(beside / (1 + beside))
    assert told < floating.plausibility
    much = replace(there, violation=2 * HARDLY)
    assert judge.likelihood(pair.source, pair.target, pose, much) == floating.plausibility


def test_parts_that_cannot_be_met_are_not_asked():
    pair = overlap()
    aside = se3.from_parts(np.eye(3), 100 * pair.source.scale.spacing * np.array([0, 0, 1.0]))
    model = replace(
        Model.of(pair.target), parts=(Part(pair.target, np.eye(4)), Part(pair.target, aside))
    )
    asked = view_pairs(pair.source, model, pair.T_target_source)
    assert [view_pair.target for view_pair in asked] == [pair.target]
    alone = view_pairs(pair.source, pair.target, pair.T_target_source)
    assert pool_evidence(asked) == pool_evidence(alone)


def test_what_was_measured_last_is_kept_as_long_as_the_views_are():
    pair = overlap()
    source, target = (replace(view) for view in (pair.source, pair.target))
    (first,) = view_pairs(source, target, pair.T_target_source)
    sides = first.sides
    (again,) = view_pairs(source, target, pair.T_target_source.copy())
    assert again.sides is sides
    for other in (view_pairs(source, target, np.eye(4)), view_pairs(target, source, np.eye(4))):
        assert other[0].sides is not sides
    (anew,) = view_pairs(source, target, pair.T_target_source)
    assert anew.sides is not sides, "another pose was asked for since"
    alive = ref(source), ref(target)
    collected = gc.isenabled()
    gc.disable()  # they go at once, without a look for cycles
    try:
        del source, target, first, again, anew, other
        assert [view() for view in alive] == [None, None]
    finally:
        if collected:
            gc.enable()


def test_a_loop_that_does_not_close_is_seen():
    pair, pose = overlap(), overlap().T_target_source
    middle = blob_views()[2].name
    truth = blob_scans(3).poses
    to_middle = se3.invert(truth[middle]) @ truth[pair.source.name]
    onwards = se3.invert(truth[pair.target.name]) @ truth[middle]
    first = replace(found(to_middle), target=middle)
    second = replace(found(onwards), source=middle)
    assert judged(found(), first, second).reliable
    # The same, told the other way round.
    reverse = replace(found(se3.invert(onwards)), source=pair.target.name, target=middle)
    assert judged(found(), first, reverse).reliable
    wrong = replace(second, T_target_source=turned(20, onwards))
    verdict = judged(found(), first, wrong)
    assert not verdict.reliable
    assert "loop" in verdict.reason and verdict.open_loop
    assert judged(found(), first, wrong, loop_tolerance=1e3).reliable
    assert judged(found(), wrong).reliable, "no loop yet"
    assert graph_of(first, second).loop(pair.source, pair.target).steps == 2
    np.testing.assert_allclose(onwards @ to_middle, pose, atol=1e-9)


def test_of_a_model_every_part_has_a_say():
    source, first, second = blob_views()
    truth = blob_scans(3).poses
    base = se3.invert(truth[first.name])
    parts = tuple(Part(view, base @ truth[view.name]) for view in (first, second))
    model = replace(Model.of(first), parts=parts)
    pose = base @ truth[source.name]
    met = view_pairs(source, model, pose)
    assert [m.target for m in met] == [first, second]
    for view_pair, part in zip(met, parts, strict=True):
        np.testing.assert_allclose(part.T_model_scan @ view_pair.T_target_source, pose, atol=1e-9)
    verdict = EvidenceJudge()(registration(source, first, pose), source, model, ViewGraph())
    assert verdict.reliable
    alone = EvidenceJudge()(registration(source, first, pose), source, first, ViewGraph())
    assert verdict.evidence["points"] > alone.evidence["points"]
    bare = replace(model, parts=())
    assert [m.target for m in view_pairs(source, bare, pose)] == [bare]


@pytest.mark.parametrize("shape", ["plane", "sphere"])
def test_what_slides_along_itself_is_ambiguous(shape):
    scans, pose = plane_scans(2, side=60).scans, None
    if shape == "sphere":
        scans = [blob_scan(sensor_pose(a), name=f"s{a}", relief=0.0) for a in (0, 40)]
        pose = np.eye(4)
    else:
        truth = plane_scans(2, side=60).poses
        pose = se3.invert(truth["plane_1"]) @ truth["plane_0"]
    source, target = pipeline().prepare(list(scans), np.random.default_rng(0))
    verdict = EvidenceJudge()(registration(source, target, pose), source, target, ())
    assert not verdict.reliable
    assert verdict.reason.startswith("ambiguous")
    assert verdict.confidence < 0.5


def test_distance_is_that_of_the_points():
    pair = overlap()
    shift = se3.from_parts(np.eye(3), np.array([3.0, 4.0, 0.0]))
    assert rms_apart(pair.source.points, shift, np.eye(4)) == pytest.approx(5.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"min_probability": 0.0},
        {"min_probability": 1.0},
        {"max_alternative": -0.1},
        {"alternative_angle": 0.0},
        {"alternative_distance": -1.0},
        {"loop_tolerance": 0.0},
    ],
)
def test_parameters_are_checked(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        EvidenceJudge(**wrong)
