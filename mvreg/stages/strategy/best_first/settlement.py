"""Join partial models that loops of hypotheses hold together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mvreg.contracts import Judge
from mvreg.evidence.pooled import ViewPair
from mvreg.stages.strategy.best_first.agreement import Agreement, against
from mvreg.stages.strategy.best_first.hypotheses import Hypotheses
from mvreg.stages.strategy.best_first.joint_verdict import together_if_doubtful
from mvreg.types import Indices

#: A loop of pairs joins partial models if it is right with this probability.
LEAST_CERTAIN = 0.95
#: Unless all scans of the partial models together make it less probable than this: wrong poses have
#: 0.05 at most, right ones 0.3 and more.
LEAST_POOLED = 0.3


class Settlement:
    """Joins what pairs say that agree with each other, the most certain first.

    Parameters
    ----------
    hypotheses : Hypotheses
        Their partial models are joined.
    judge : Judge
    """

    def __init__(self, hypotheses: Hypotheses, judge: Judge) -> None:
        self.hypotheses, self.judge = hypotheses, judge
        self.models = hypotheses.models
        self.refused: set[frozenset[int]] = set()
        self.supported: set[int] = set()  # views that a loop holds
        self.seen: tuple[int, bytes] | None = None

    def joined(self) -> Iterator[tuple[Agreement, float]]:
        """Join as long as a loop is certain: each agreement with its probability."""
        while self.changed():
            found = self.hypotheses.agreements()
            for agreement in found:
                rivals = against(agreement, found)
                certainty = agreement.odds / (1 + agreement.odds + rivals)
                likely = all(bundle.likely for bundle in agreement.bundles)
                if likely and certainty >= LEAST_CERTAIN and self.join(agreement):
                    yield agreement, certainty
                    break

    def changed(self) -> bool:
        """Whether anything is known, or joined, that was not when this was asked before."""
        now = len(self.hypotheses.known), self.models.group.tobytes()
        before, self.seen = self.seen, now
        return now != before

    def join(self, agreement: Agreement) -> bool:
        """Join the partial models of an agreement, unless all scans together contradict it."""
        members = [edge for bundle in agreement.bundles for edge in bundle.members]
        key = frozenset(edge.attempt for edge in members)
        if key in self.refused:
            return False
        trial, before = self.models.copy(), self.models.group.copy()
        for edge in agreement.edges:
            trial.join(edge.source, edge.target, edge.T_target_source)
        groups = sorted({end for bundle in agreement.bundles for end in bundle.ends})
        crossing: list[ViewPair] = []
        for index, label in enumerate(groups[:-1]):
            later: Indices = np.flatnonzero(np.isin(before, groups[index + 1 :]))
            crossing += trial.view_pairs(np.flatnonzero(before == label).tolist(), later.tolist())
        if together_if_doubtful(self.judge, crossing).plausibility < LEAST_POOLED:
            self.refused.add(key)
            return False
        for edge in agreement.edges:
            self.models.join(edge.source, edge.target, edge.T_target_source)
        self.supported.update(*(edge.pair for edge in members))
        return True
