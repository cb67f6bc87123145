"""Partial models grow: attempts, joins by a verdict, and joins by pairs that agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.stages.strategy.best_first.closing import closing_pair
from mvreg.stages.strategy.best_first.hypotheses import Agreement, Hypotheses
from mvreg.stages.strategy.best_first.joint_verdict import Check, checked_for_symmetry, together
from mvreg.stages.strategy.best_first.loop_closure import LoopClosure
from mvreg.stages.strategy.best_first.outcome import outcome
from mvreg.stages.strategy.best_first.search import Search
from mvreg.stages.strategy.best_first.second_look import looked_at_again
from mvreg.types import Array, Edge, Pair, Registration, Verdict, View, ViewGraph

#: A loop of pairs joins partial models if it is right with this probability.
LEAST_CERTAIN = 0.95
#: Unless all scans of the partial models together make it less probable than this: wrong poses have
#: 0.05 at most, right ones 0.3 and more.
LEAST_POOLED = 0.1


@dataclass
class Growth:
    """Partial models that grow, and all that is known of their view pairs.

    Parameters
    ----------
    search : Search
    pipeline : Pipeline
    scores : (N, N) array
        Overlap scores before any attempt.
    rng : numpy.random.Generator
    min_probability : float
        See `BestFirst`.
    """

    search: Search
    pipeline: Pipeline
    scores: Array
    rng: np.random.Generator
    min_probability: float
    pairs: list[Pair] = field(default_factory=list)
    graph: ViewGraph = field(default_factory=ViewGraph)
    refused: set[frozenset[int]] = field(default_factory=set)
    supported: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.models = self.search.models
        self.loops = LoopClosure(self.search, self.pipeline, self.pairs, self.rng)
        self.hypotheses = Hypotheses(self.models)

    def grow(self) -> None:
        """Join partial models as long as there is something to try."""
        while (found := self.search.next()) is not None:
            if self.attempt(*found):
                self.search.joined()
                self.told()
            self.settle()

    def attempt(self, source: int, targets: Sequence[int]) -> bool:
        """Register a view to views of another partial model, and join them if that is reliable."""
        models = self.models
        target, view = models.target(targets, self.pipeline), models.views[source]
        checks = (
            checked_for_symmetry(self.pipeline, view, target, self.graph),
            lambda registration, verdict: self.consistent_join(
                source, targets[0], registration, verdict
            ),
            self.loops.check(source, targets, self.graph),
        )
        registration, pair = self.pipeline.register(
            view, target, self.graph, self.rng.spawn(1)[0], checks
        )
        self.pairs.append(replace(pair, target=models.views[targets[0]].name))
        if registration is not None and not pair.verdict.reliable:
            registration = self.reconsider(source, targets[0], registration, view, target, checks)
        if registration is None:
            self.search.failed(source, targets)
            return False
        models.join(source, targets[0], registration.T_target_source)
        self.graph = self.graph.with_edge(Edge.of(registration, view, target))
        return True

    def reconsider(
        self,
        source: int,
        target: int,
        registration: Registration,
        moving: View,
        staying: View,
        checks: Sequence[Check],
    ) -> Registration | None:
        """Look at all poses of the last attempt: a reliable one, or None and hypotheses to keep."""
        attempt = len(self.pairs) - 1
        found, likely = looked_at_again(
            self.pipeline, registration, moving, staying, source, self.hypotheses
        )
        best = int(np.argmax(likely))
        if best > 0 and likely[best] > likely[0]:
            others = [one.T_target_source for k, one in enumerate(found) if k != best]
            chosen = replace(found[best], alternatives=np.array(others))
            verdict = self.pipeline.judge(chosen, moving, staying, self.graph)
            for check in checks:
                verdict = check(chosen, verdict)
            self.pairs[attempt] = replace(
                self.pairs[attempt], verdict=verdict, T_target_source=chosen.T_target_source,
                overlap=chosen.overlap, trimmed_mse=chosen.trimmed_mse,
            )  # fmt: skip
            if verdict.reliable:
                return chosen
        poses = [one.T_target_source for one in found]
        kept = self.hypotheses.add(source, target, poses, likely, attempt)
        if kept:
            best_kept = max(kept, key=lambda one: one.probability)
            closing = closing_pair(self.hypotheses, best_kept, self.search.registered)
            if closing is not None:
                self.search.suggest(*closing)
        return None

    def told(self) -> None:
        """Tell observers where the views are now."""
        self.pipeline.revise(outcome(self.models, self.scores, self.pairs))

    def consistent_join(
        self, source: int, target: int, registration: Registration, verdict: Verdict
    ) -> Verdict:
        """The verdict, unless the views that move along with the source speak against it."""
        models = self.models
        moving = models.members(int(models.group[source]))
        if not verdict.reliable or len(moving) == 1:
            return verdict
        staying = models.members(int(models.group[target]))
        trial = models.copy()
        trial.join(source, target, registration.T_target_source)
        found = together(self.pipeline.judge, trial.view_pairs(moving.tolist(), staying.tolist()))
        if found.probability >= self.min_probability:
            return verdict
        reason = f"the other scans of the partial models contradict it: {found.reason}"
        return replace(verdict, reliable=False, reason=reason)

    def settle(self) -> None:
        """Join what pairs say that agree with each other, as long as some do."""
        joined = True
        while joined:
            joined = False
            found = self.hypotheses.agreements()
            for agreement in found:
                certainty = agreement.odds / (1 + agreement.odds + against(agreement, found))
                if certainty < LEAST_CERTAIN:
                    continue
                if self.join(agreement, certainty):
                    joined = True
                    self.told()
                    break

    def join(self, agreement: Agreement, certainty: float) -> bool:
        """Join the partial models of an agreement, unless all scans together contradict it."""
        key = frozenset(edge.attempt for bundle in agreement.bundles for edge in bundle.members)
        if key in self.refused:
            return False
        models = self.models
        before = models.group.copy()
        trial = models.copy()
        for edge in agreement.edges:
            trial.join(edge.source, edge.target, edge.T_target_source)
        groups = sorted({end for bundle in agreement.bundles for end in bundle.ends})
        crossing = []
        for index, label in enumerate(groups[:-1]):
            later = np.flatnonzero(np.isin(before, groups[index + 1 :]))
            crossing += trial.view_pairs(np.flatnonzero(before == label).tolist(), later.tolist())
        found = together(self.pipeline.judge, crossing)
        if found.probability < LEAST_POOLED:
            self.refused.add(key)
            return False
        for edge in agreement.edges:
            models.join(edge.source, edge.target, edge.T_target_source)
            views = models.views
            self.graph = self.graph.with_edge(
                Edge(views[edge.source].name, views[edge.target].name, edge.T_target_source)
            )
        for bundle in agreement.bundles:
            for edge in bundle.members:
                self.supported |= edge.pair
                self.confirm(edge.attempt, certainty)
        self.search.joined()
        return True

    def confirm(self, attempt: int, certainty: float) -> None:
        """Record that a pair was right after all, since others agree with it."""
        pair = self.pairs[attempt]
        verdict = replace(
            pair.verdict, reliable=True, reason="other pairs agree with it",
            confidence=max(certainty, pair.verdict.confidence or 0.0),
        )  # fmt: skip
        self.pairs[attempt] = replace(pair, verdict=verdict)


def against(agreement: Agreement, found: Sequence[Agreement]) -> float:
    """The odds of the best agreement that cannot be right together with this one."""
    own = {bundle.ends: bundle for bundle in agreement.bundles}
    return max(
        (
            other.odds
            for other in found
            if any(own.get(bundle.ends, bundle) is not bundle for bundle in other.bundles)
        ),
        default=0.0,
    )
