"""Partial models grow: attempts, joins by a verdict, and joins by pairs that agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.evidence.calibration import LOOP
from mvreg.stages.strategy.best_first.agreement import Agreement
from mvreg.stages.strategy.best_first.closing import closing_pair
from mvreg.stages.strategy.best_first.hypotheses import Hypotheses
from mvreg.stages.strategy.best_first.joint_verdict import Check, checked_for_symmetry, together
from mvreg.stages.strategy.best_first.loop_closure import LoopClosure
from mvreg.stages.strategy.best_first.outcome import outcome
from mvreg.stages.strategy.best_first.search import Search
from mvreg.stages.strategy.best_first.second_look import looked_at_again
from mvreg.stages.strategy.best_first.settlement import Settlement
from mvreg.types import Array, Edge, Pair, Registration, Verdict, View, ViewGraph


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

    def __post_init__(self) -> None:
        self.models = self.search.models
        self.loops = LoopClosure(self.search, self.pipeline, self.pairs, self.rng)
        self.hypotheses = Hypotheses(self.models)
        self.settlement = Settlement(self.hypotheses, self.pipeline.judge)

    def grow(self) -> None:
        """Join partial models as long as there is something to try."""
        while (found := self.search.next()) is not None:
            if self.attempt(*found):
                self.search.joined()
                self.told()
            for agreement, certainty in self.settlement.joined():
                self.record(agreement, certainty)
                self.search.joined()
                self.told()

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
        if best > 0:
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
        if found.plausibility >= self.min_probability:
            return verdict
        reason = f"the other scans of the partial models contradict it: {found.reason}"
        return replace(verdict, reliable=False, reason=reason)

    def record(self, agreement: Agreement, certainty: float) -> None:
        """Keep that pairs were right after all, since others agree with them."""
        views = self.models.views
        for bundle in agreement.bundles:
            for edge in bundle.members:
                names = views[edge.source].name, views[edge.target].name
                self.graph = self.graph.with_edge(Edge(*names, edge.T_target_source))
                pair = self.pairs[edge.attempt]
                verdict = replace(
                    pair.verdict, reliable=True, reason="other pairs agree with it",
                    confidence=max(certainty, pair.verdict.confidence or 0.0),
                    evidence={**pair.verdict.evidence, LOOP: certainty},
                )  # fmt: skip
                self.pairs[edge.attempt] = replace(
                    pair, verdict=verdict, T_target_source=edge.T_target_source
                )
