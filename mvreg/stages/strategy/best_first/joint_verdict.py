"""What the judge says of several view pairs together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.contracts import JointJudge, Judge, Pipeline
from mvreg.evidence.pooled import ViewPair
from mvreg.parallel import in_threads
from mvreg.stages.strategy.best_first.other_side import other_side
from mvreg.stages.strategy.best_first.partial_models import PartialModels, contact_points
from mvreg.stages.strategy.best_first.symmetry import symmetry_hypotheses
from mvreg.types import Array, Registration, Verdict, View, ViewGraph

#: What is so probable on a subsample is not evaluated again: of 93 scans of Bunny, Dragon and
#: Buddha, and of halves of them, the two evaluations differ by 0.04 at most.
CERTAIN_ON_SUBSAMPLE = 0.9
#: A pair that shares less than this of the points of either view, or fewer of them, says nothing to
#: a judge of single registrations.
LEAST_OVERLAP, LEAST_POINTS = 0.1, 50
#: A pose is ambiguous if it is so probable that the source shows the other side.
MOST_OTHER_SIDE = 0.3

Check = Callable[[Registration, Verdict], Verdict]


@dataclass(frozen=True)
class Together:
    """The `probability` that several view pairs are all right, and what speaks against it.

    `plausibility` is the same, whether or not they can slide together: what can slide contradicts
    nothing.
    """

    probability: float
    reason: str
    plausibility: float


def together(judge: Judge, pairs: Sequence[ViewPair]) -> Together:
    """What a judge says of several view pairs.

    A `JointJudge` pools what they show. Any other judge is asked about each by itself, as about a
    registration of what lies together under the pose: the probability is then the share of the
    points in pairs that it relies on, and 1 where no two views overlap enough to ask.
    """
    if isinstance(judge, JointJudge):
        evidence = judge.together(pairs)
        return Together(evidence.probability, evidence.reason, evidence.plausibility)
    asked = [one for one in in_threads(overlapping, pairs) if one is not None]
    if not asked:
        return Together(1.0, "nothing overlaps enough to be judged", 1.0)
    verdicts = [judge(found, pair.source, pair.target, ViewGraph()) for pair, found in asked]
    weights = np.array([len(found.pairs) for _, found in asked], dtype=float)
    reliable = np.array([verdict.reliable for verdict in verdicts])
    worst = verdicts[int(np.where(reliable, -1.0, weights).argmax())]
    share = float(weights[reliable].sum() / weights.sum())
    return Together(share, worst.reason, share)


def overlapping(pair: ViewPair) -> tuple[ViewPair, Registration] | None:
    """A view pair with a registration of what lies together; None where they hardly overlap."""
    found = contact_points(pair.source, pair.target, pair.T_target_source)
    smaller = min(len(pair.source.points), len(pair.target.points))
    if len(found.pairs) < max(LEAST_POINTS, LEAST_OVERLAP * smaller):
        return None
    return pair, found


def together_if_doubtful(judge: Judge, pairs: Sequence[ViewPair]) -> Together:
    """As `together`; by a subsample, where that leaves no doubt that they are right."""
    if isinstance(judge, JointJudge):
        found = together(judge, [pair.subsampled for pair in pairs])
        if found.plausibility > CERTAIN_ON_SUBSAMPLE:
            return found
    return together(judge, pairs)


def error_probability(judge: Judge, pairs: Sequence[ViewPair]) -> float:
    """The probability that a view is in the wrong place, by all its pairs; or roughly so."""
    if isinstance(judge, JointJudge):
        subsampled = together(judge, [pair.subsampled for pair in pairs]).probability
        if subsampled > CERTAIN_ON_SUBSAMPLE:
            return 1 - subsampled
    return 1 - together(judge, pairs).probability


def consistent_join(
    models: PartialModels,
    judge: Judge,
    source: int,
    target: int,
    T_target_source: Array,
    verdict: Verdict,
    min_probability: float,
) -> Verdict:
    """The verdict, unless the views of two partial models together contradict a join."""
    moving = models.members(int(models.group[source])).tolist()
    staying = models.members(int(models.group[target])).tolist()
    trial = models.copy()
    trial.join(source, target, T_target_source)
    found = together_if_doubtful(judge, trial.view_pairs(moving, staying))
    if found.plausibility >= min_probability:
        return verdict
    reason = f"the other scans of the partial models contradict it: {found.reason}"
    return replace(verdict, reliable=False, reason=reason)


def checked_for_symmetry(pipeline: Pipeline, source: View, target: View, graph: ViewGraph) -> Check:
    """A check of a reliable pose beside the poses that a symmetry would allow."""

    def check(registration: Registration, verdict: Verdict) -> Verdict:
        if not verdict.reliable:
            return verdict
        alternatives = symmetry_hypotheses(registration, source, target, pipeline.refine)
        if not len(alternatives):
            return verdict
        return pipeline.judge(
            replace(registration, alternatives=alternatives), source, target, graph
        )

    return check


def checked_for_other_side(source: View, target: View) -> Check:
    """A check of a reliable pose of something thin, which may show its other side."""

    def check(registration: Registration, verdict: Verdict) -> Verdict:
        if not verdict.reliable:
            return verdict
        other = other_side(registration, source, target)
        if other <= MOST_OTHER_SIDE:
            return verdict
        confidence = (verdict.confidence or 1.0) * (1 - other)
        reason = "ambiguous: it may be the other side of something thin"
        return replace(
            verdict, reliable=False, reason=reason, confidence=confidence, score=1 - confidence
        )

    return check
