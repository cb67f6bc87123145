"""What the judge says of several view pairs together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.contracts import JointJudge, Judge, Pipeline
from mvreg.evidence.pooled import Meeting
from mvreg.parallel import in_threads
from mvreg.stages.strategy.best_first.partial_models import meeting_points
from mvreg.stages.strategy.best_first.symmetry import turned
from mvreg.types import Registration, Verdict, View, ViewGraph

#: A view that is so probably in its place by a rough look is not looked at again: of 93 scans of
#: Bunny, Dragon and Buddha, and of halves of them, the two looks differ by 0.04 at most.
SURE = 0.9
#: A pair that shares less than this of the points of either view, or fewer of them, says nothing to
#: a judge of single registrations.
LEAST_OVERLAP, LEAST_POINTS = 0.1, 50

Check = Callable[[Registration, Verdict], Verdict]


@dataclass(frozen=True)
class Together:
    """The `probability` that several view pairs are all right, and what speaks against it."""

    probability: float
    reason: str


def together(judge: Judge, pairs: Sequence[Meeting]) -> Together:
    """What a judge says of several view pairs.

    A `JointJudge` pools what they show. Any other judge is asked about each by itself, as about a
    registration of what lies together under the pose: the probability is then the share of the
    points in pairs that it relies on, and 1 where no two views overlap enough to ask.
    """
    if isinstance(judge, JointJudge):
        evidence = judge.together(pairs)
        return Together(evidence.probability, evidence.reason)
    asked = [one for one in in_threads(overlapping, pairs) if one is not None]
    if not asked:
        return Together(1.0, "nothing overlaps enough to be judged")
    verdicts = [judge(found, pair.source, pair.target, ViewGraph()) for pair, found in asked]
    weights = np.array([len(found.pairs) for _, found in asked], dtype=float)
    reliable = np.array([verdict.reliable for verdict in verdicts])
    worst = verdicts[int(np.where(reliable, -1.0, weights).argmax())]
    return Together(float(weights[reliable].sum() / weights.sum()), worst.reason)


def overlapping(pair: Meeting) -> tuple[Meeting, Registration] | None:
    """A view pair with a registration of what lies together; None where they hardly overlap."""
    found = meeting_points(pair.source, pair.target, pair.T_target_source)
    smaller = min(len(pair.source.points), len(pair.target.points))
    if len(found.pairs) < max(LEAST_POINTS, LEAST_OVERLAP * smaller):
        return None
    return pair, found


def doubt(judge: Judge, pairs: Sequence[Meeting]) -> float:
    """The probability that a view is in the wrong place, by all its pairs; or roughly so."""
    if isinstance(judge, JointJudge):
        rough = together(judge, [pair.rough for pair in pairs]).probability
        if rough > SURE:
            return 1 - rough
    return 1 - together(judge, pairs).probability


def beside_its_turns(pipeline: Pipeline, source: View, target: View, graph: ViewGraph) -> Check:
    """A check of a reliable pose beside the poses that a symmetry would allow."""

    def check(registration: Registration, verdict: Verdict) -> Verdict:
        if not verdict.reliable:
            return verdict
        rivals = turned(registration, source, target, pipeline.refine)
        if not len(rivals):
            return verdict
        return pipeline.judge(replace(registration, rivals=rivals), source, target, graph)

    return check
