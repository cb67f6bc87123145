"""Most promising first: overlap scores, partial models, joins that all scans agree with."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mvreg import events
from mvreg.errors import InputError
from mvreg.evidence import pooling
from mvreg.evidence.pooled import pool_evidence
from mvreg.geometry import se3
from mvreg.stages.describe.spectrum import NoDescribe
from mvreg.stages.judge.evidence import EvidenceJudge
from mvreg.stages.strategy.best_first.growth import Growth
from mvreg.stages.strategy.best_first.joint_verdict import consistent_join
from mvreg.stages.strategy.best_first.overlap_score import overlap_scores
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.stages.strategy.best_first.search import Search
from mvreg.stages.strategy.best_first.strategy import BestFirst, error_probability, outcome
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.testing.results import misplacement
from mvreg.testing.views import scaled_view
from mvreg.types import Verdict

RADII = (1.0, 2.0, 3.0)
JUDGED = replace(pipeline(), judge=EvidenceJudge())


@cache
def two_objects():
    """Four scans of one blob and three of another, interleaved, prepared together; their truth."""
    sets = [blob_scans(4), blob_scans(3, number=2)]
    scans = [replace(s, name=f"{k}{s.name}") for k, one in enumerate(sets) for s in one.scans]
    truth = {f"{k}{name}": pose for k, one in enumerate(sets) for name, pose in one.poses.items()}
    views = JUDGED.prepare([scans[k] for k in (4, 0, 1, 5, 2, 6, 3)], np.random.default_rng(0))
    return views, truth


@cache
def separated():
    views, _ = two_objects()
    told = []
    answer = BestFirst()(views, JUDGED.observed_by(told.append), np.random.default_rng(0))
    return answer, told


def test_score_is_larger_where_scans_overlap():
    views, _ = two_objects()
    found = overlap_scores(views, RADII, 5)
    np.testing.assert_array_equal(found, found.T)
    assert not np.diag(found).any()
    first = np.array([view.name.startswith("0") for view in views])
    same = (first[:, None] == first) & ~np.eye(len(views), dtype=bool)
    other = first[:, None] != first
    assert found[same].mean() > 1.15 * found[other].mean()


def test_score_knows_no_unit_and_no_order():
    views = blob_views(3)
    found = overlap_scores(views, RADII, 5)
    scaled = overlap_scores([scaled_view(view, 1024.0) for view in views], RADII, 5)
    np.testing.assert_allclose(scaled, found, rtol=1e-9)
    np.testing.assert_allclose(overlap_scores(views[::-1], RADII, 5), found[::-1, ::-1], rtol=0.1)


def test_score_asks_nothing_of_the_signs_of_normals_that_mean_nothing():
    views = blob_views(3)
    unsure = [replace(v, features=replace(v.features, oriented=False)) for v in views]
    turned = [
        replace(v, features=replace(v.features, normals=sign * v.features.normals))
        for v, sign in zip(unsure, (1, -1, 1), strict=True)
    ]
    found = overlap_scores(unsure, RADII, 5)
    np.testing.assert_array_equal(overlap_scores(turned, RADII, 5), found)
    assert not np.array_equal(overlap_scores(views, RADII, 5), found)


def test_scans_without_keypoints_score_nothing():
    views = blob_views(3)
    bare = NoDescribe()(views[1].scan, views[1].points, 1.0)
    found = overlap_scores([views[0], replace(views[1], features=bare), views[2]], RADII, 5)
    assert not found[1].any()
    assert found[0, 2] > 0
    empty = [replace(view, features=bare) for view in views]
    assert not overlap_scores(empty, RADII, 5).any()
    lonely = [
        replace(view, points=view.points[:3] + 1e6, normals=view.normals[:3]) for view in views
    ]
    assert not overlap_scores(lonely, RADII, 5).any(), "keypoints far from all points have no shape"


def test_scans_of_two_objects_are_separated():
    answer, _ = separated()
    views, truth = two_objects()
    assert {name[0] for name in answer.poses} == {"0"}
    assert len(answer.poses) == 4
    assert [sorted(c) for c in answer.components] == [["1blob_0", "1blob_1", "1blob_2"]]
    assert answer.unregistered == ()
    for poses in (answer.poses, *answer.components):
        first = next(iter(poses))
        np.testing.assert_array_equal(poses[first], np.eye(4))
        placed = [view for view in views if view.name in poses]
        assert misplacement(poses, truth, placed, first) < 2


def test_one_foreign_scan_is_reported():
    views, _ = two_objects()
    left = [view for view in views if view.name not in ("1blob_1", "1blob_2")]
    answer = BestFirst()(left, JUDGED, np.random.default_rng(0))
    assert answer.unregistered == ("1blob_0",)
    assert len(answer.poses) == 4
    assert answer.components == ()


def test_observers_are_told_all_poses_after_each_join():
    answer, told = separated()
    revised = [event for event in told if isinstance(event, events.PosesRevised)]
    joins = sum(pair.verdict.reliable for pair in answer.pairs)
    assert joins == 5  # 4 - 1 and 3 - 1
    assert len(revised) == joins + 1
    assert revised[-1].poses == answer.poses
    sizes = [len(e.poses) + sum(map(len, e.components)) for e in revised]
    assert sizes == sorted(sizes)
    assert sizes[-1] == 7


def test_joined_groups_keep_their_inner_poses():
    views = blob_views(3)
    models = PartialModels(views)
    rng = np.random.default_rng(3)
    first, second = se3.random(rng, 50.0), se3.random(rng, 50.0)
    models.join(0, 1, first)
    models.join(2, 0, second)
    np.testing.assert_allclose(models.relative(1, 0), first, atol=1e-9)
    np.testing.assert_allclose(models.relative(0, 2), second, atol=1e-9)
    np.testing.assert_allclose(models.relative(1, 2), first @ second, atol=1e-9)
    assert [members.tolist() for members in models.groups()] == [[0, 1, 2]]
    models.leave(1)
    assert [members.tolist() for members in models.groups()] == [[0, 2], [1]]
    np.testing.assert_allclose(models.relative(0, 2), second, atol=1e-9)


def test_a_target_is_merged_of_the_chosen_and_knows_the_rest():
    views, truth = blob_views(3), blob_scans(3).poses
    models = joined(views, truth)
    target = models.target([1, 0], pipeline())
    assert target.members == (views[1].name, views[0].name, views[2].name)
    assert len(views[1].points) < len(target.points) < len(views[0].points) + len(views[1].points)
    alone = PartialModels(views)
    assert alone.target([2], pipeline()) is views[2]


def joined(views, truth):
    models = PartialModels(views)
    for k in range(1, len(views)):
        models.join(k, 0, se3.invert(truth[views[0].name]) @ truth[views[k].name])
    return models


def test_a_view_that_all_others_contradict_is_taken_back():
    views, truth = blob_views(3), blob_scans(3).poses
    models = joined(views, truth)
    assert BestFirst().withdraw(models, EvidenceJudge()) == []
    centre = views[2].points.mean(axis=0)
    turn = se3.exp(np.array([0.0, 0.0, 1.0, 0, 0, 0]))
    turn[:3, 3] = centre - turn[:3, :3] @ centre
    models.poses[2] = models.poses[2] @ turn
    assert BestFirst().withdraw(models, EvidenceJudge()) == [2]
    answer = outcome(models, np.ones((3, 3)), [])
    assert answer.unregistered == (views[2].name,)


def test_a_subsample_is_enough_for_a_view_in_its_place(monkeypatch):
    steps = []
    asked = pooling.directed_evidence
    monkeypatch.setattr(
        pooling, "directed_evidence", lambda *args: steps.append(args[3]) or asked(*args)
    )
    views, truth = blob_views(3), blob_scans(3).poses
    models = joined(views, truth)
    for view_pairs in models.incident_pairs([0, 1, 2]).values():
        assert error_probability(EvidenceJudge(), view_pairs) == pytest.approx(
            1 - pool_evidence(view_pairs).probability, abs=0.05
        )
    steps.clear()
    assert BestFirst().withdraw(models, EvidenceJudge()) == []
    assert set(steps) == {pooling.SUBSAMPLING}
    models.poses[2] = models.poses[2] @ se3.exp(np.array([0.0, 0.0, 1.0, 0, 0, 0]))
    wrong = models.incident_pairs([0, 1, 2])[2]
    assert error_probability(EvidenceJudge(), wrong) == 1 - pool_evidence(wrong).probability > 0.5


def test_a_join_is_refused_that_the_other_scans_object_to():
    views, truth = two_objects()
    first = [k for k, view in enumerate(views) if view.name.startswith("0")]
    names = [views[k].name for k in first]
    models = PartialModels([views[k] for k in first])

    def true(target, source):
        return se3.invert(truth[names[target]]) @ truth[names[source]]

    models.join(1, 0, true(0, 1) @ se3.exp(np.array([0, 0, 1.2, 0, 0, 0])))  # wrongly joined
    found = JUDGED.refine(models.views[2], models.views[0], true(0, 2))
    verdict = Verdict(True, 0.0, 1.0, "fine")
    models.join(3, 2, true(2, 3))
    pose = found.T_target_source
    joined = consistent_join(models, JUDGED.judge, 2, 0, pose, verdict, 0.5)
    assert not joined.reliable
    assert "contradict" in joined.reason
    alone = PartialModels(models.views)
    assert consistent_join(alone, JUDGED.judge, 2, 0, pose, verdict, 0.5) is verdict


def test_partial_models_that_nowhere_meet_have_no_view_pairs():
    models = PartialModels(blob_views(3))
    models.join(1, 0, se3.from_parts(np.eye(3), np.array([1e4, 0.0, 0.0])))
    models.join(2, 0, se3.from_parts(np.eye(3), np.array([0.0, 1e4, 0.0])))
    assert models.view_pairs([0], [1, 2]) == []
    assert models.view_pairs([0, 1, 2], [0, 1, 2]) == []


def test_of_many_joins_observers_are_told_now_and_then():
    views, told = blob_views(3), []
    models = PartialModels([*views] * 60)
    growth = Growth(
        Search(np.zeros((180, 180)), models, 3, 10), JUDGED.observed_by(told.append),
        np.zeros((180, 180)), np.random.default_rng(0), 0.5,
    )  # fmt: skip
    for _ in range(10):
        growth.joined()
    assert len(told) == 2
    growth.tell()
    growth.tell()
    assert len(told) == 3, "the last joins are told once"


def test_a_copy_of_partial_models_changes_alone():
    models = PartialModels(blob_views(3))
    models.join(1, 0, se3.exp(np.array([0, 0, 0.1, 1, 0, 0])))
    before = [pose.copy() for pose in models.poses], models.group.copy()
    trial = models.copy()
    np.testing.assert_array_equal(trial.poses, before[0])
    np.testing.assert_array_equal(trial.group, before[1])
    trial.join(2, 0, se3.exp(np.array([0, 0, 0.2, 0, 1, 0])))
    trial.leave(1)
    np.testing.assert_array_equal(models.poses, before[0])
    np.testing.assert_array_equal(models.group, before[1])


def test_the_most_promising_is_tried_first_then_alone_then_more_of_them():
    models = PartialModels(blob_views(4))
    scores = np.array([[0, 0.1, 0.2, 0.15], [0.1, 0, 0.5, 0.4], [0.2, 0.5, 0, 0.4],
                         [0.15, 0.4, 0.4, 0]])  # fmt: skip
    search = Search(scores, models, parts=2, max_failures=4)
    assert search.batch() == [(2, [1]), (3, [1])]
    models.join(2, 1, np.eye(4))
    models.join(3, 1, np.eye(4))
    tried = []
    while batch := search.batch():
        tried += batch
        for found in batch:
            search.failed(*found)
    assert [source for source, _ in tried] == [0] * 4, "max_failures is respected"
    assert tried[0][1] == [2, 3]
    assert [len(targets) for _, targets in tried] == [2, 1, 3, 1]
    assert len({frozenset(targets) for _, targets in tried}) == 4, "nothing is tried twice"
    assert scores[0, 2] == 0.2, "the caller's scores are changed"


def test_the_search_ends_after_many_failures_in_a_row():
    models = PartialModels(blob_views(4))
    search = Search(np.ones((4, 4)) - np.eye(4), models, parts=1, max_failures=100)
    search.in_a_row = 11
    found = search.batch()
    assert found
    search.joined()
    assert search.batch() == found
    search.in_a_row = 11
    search.failed(*found[0])
    assert search.batch() == []


@pytest.mark.parametrize(
    "wrong", [{"radii": []}, {"radii": [2.0, 1.0]}, {"parts": 0}, {"max_failures": -1}]
)
def test_parameters_are_checked(wrong):
    with pytest.raises(InputError, match="strategy"):
        BestFirst(**wrong)
