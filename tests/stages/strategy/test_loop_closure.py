"""A wrong pair that looks right is refused for its loop, in the default strategy."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from mvreg import events
from mvreg.geometry import se3
from mvreg.stages.judge.evidence import EvidenceJudge
from mvreg.stages.refine.trimmed import TrimmedICP
from mvreg.stages.strategy.best_first import overlap_score
from mvreg.stages.strategy.best_first.loop_closure import CERTAIN
from mvreg.stages.strategy.best_first.strategy import BestFirst
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.types import Candidates, Matches, Verdict

#: The first two views are joined, and the last two; then the one pair with the other.
PROMISES = np.array(
    [[0, 0.9, 0.1, 0.3], [0.9, 0, 0.5, 0.1], [0.1, 0.5, 0, 0.8], [0.3, 0.1, 0.8, 0]]
)


@dataclass(frozen=True)
class Nothing:
    def __call__(self, source, target):
        return Matches.none()


@dataclass(frozen=True)
class Knows:
    """The true pose, but for one pair of views, whichever way round it is asked."""

    lies: frozenset = frozenset()
    motion: np.ndarray = field(default_factory=lambda: np.eye(4))

    def __call__(self, source, target, seeds, rng):
        poses, first = blob_scans(4).poses, target
        if hasattr(target, "parts"):
            first = target.parts[0].view
        pose = se3.invert(poses[first.name]) @ poses[source.name]
        if {source.name, first.name} == self.lies:
            pose = pose @ self.motion
        return Candidates(pose[None], np.zeros(1), (Matches.none().indices,))


@dataclass(frozen=True)
class Stays:
    def __call__(self, source, target, T_init):
        return TrimmedICP(max_iterations=0)(source, target, T_init)


@dataclass(frozen=True)
class Gullible(EvidenceJudge):
    """Believes every pose, less than nearly certainly, but looks whether loops close."""

    confidence: float = 0.96

    def __call__(self, registration, source, target, graph):
        open_loop = not self.closes_loops(registration, source, target, graph)
        LOOPS.append(graph.loop(source, target) is not None)
        why = "the loop does not close" if open_loop else "believed"
        return Verdict(not open_loop, 0.0, 1.0, why, self.confidence, {}, open_loop)

    def together(self, pairs):
        found = super().together(pairs)
        return replace(
            found, surface_overlap=1.0, residual=0.0, agreement=1.0, violation=0.0,
            localizability=1.0, residual_step=0.0, points=10000,
        )  # fmt: skip


LOOPS: list[bool] = []


@pytest.fixture(autouse=True)
def promised(monkeypatch):
    monkeypatch.setattr(overlap_score, "overlap_scores", lambda *_: PROMISES.copy())
    monkeypatch.setattr(
        "mvreg.stages.strategy.best_first.joint_verdict.symmetry_hypotheses",
        lambda *_: np.empty((0, 4, 4)),
    )
    LOOPS.clear()


def run(judge, *lies):
    views = blob_views(4)
    shift = se3.exp(np.array([0.0, 0.4, 0.0, 3.0, 0.0, 0.0]))
    liar = Knows(frozenset(views[k].name for k in lies), shift)
    stages = replace(pipeline(), seed=Nothing(), propagate=liar, refine=Stays(), judge=judge)
    told = []
    answer = BestFirst()(views, stages.observed_by(told.append), np.random.default_rng(0))
    return answer, told


def misplaced(answer):
    """The largest angle by which two placed views are turned against the truth (degrees)."""
    truth = blob_scans(4).poses
    angles = [
        se3.rotation_angle(
            se3.invert(truth[a]) @ truth[b], se3.invert(answer.poses[a]) @ answer.poses[b]
        )
        for a in answer.poses
        for b in answer.poses
    ]
    return np.rad2deg(max(angles))


def test_a_wrong_pair_is_refused_for_its_loop():
    answer, told = run(Gullible(), 1, 2)
    refused = [pair for pair in answer.pairs if pair.verdict.open_loop]
    assert {frozenset((pair.source, pair.target)) for pair in refused} >= {
        frozenset(view.name for view in blob_views(4)[1:3])
    }
    assert "does not close" in refused[-1].verdict.reason
    assert any(LOOPS), "the judge has seen a loop"
    assert misplaced(answer) < 1e-3 and not answer.unregistered
    recorded = [event.pair for event in told if isinstance(event, events.PairRegistered)]
    assert len(recorded) == len(answer.pairs)


def test_without_the_loop_it_would_have_been_believed():
    answer, _ = run(Gullible(loop_tolerance=1e9), 1, 2)
    assert misplaced(answer) > 10 and not any(pair.verdict.open_loop for pair in answer.pairs)


def test_a_join_that_is_nearly_certain_needs_no_second_pair():
    answer, _ = run(Gullible(confidence=CERTAIN))
    assert len(answer.pairs) == 3 and not any(LOOPS)
    doubted, _ = run(Gullible())
    assert len(doubted.pairs) == 4 and sum(LOOPS) == 1
    for name, pose in answer.poses.items():
        np.testing.assert_array_equal(doubted.poses[name], pose)
