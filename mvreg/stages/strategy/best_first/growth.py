"""Partial models grow: rounds of attempts, joins by a verdict, and joins by pairs that agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.contracts import JointJudge, Pipeline
from mvreg.evidence.calibration import LOOP
from mvreg.stages.strategy.best_first.agreement import Agreement
from mvreg.stages.strategy.best_first.attempt import Attempt
from mvreg.stages.strategy.best_first.attempted import Outcome
from mvreg.stages.strategy.best_first.closing import closing_pair
from mvreg.stages.strategy.best_first.hypotheses import TOLERANCE, Hypotheses, compared
from mvreg.stages.strategy.best_first.joint_verdict import consistent_join
from mvreg.stages.strategy.best_first.loop_closure import second_pair
from mvreg.stages.strategy.best_first.outcome import outcome
from mvreg.stages.strategy.best_first.search import Search
from mvreg.stages.strategy.best_first.settlement import Settlement
from mvreg.surface.displacement import rms_apart
from mvreg.types import Array, Edge, Pair, ViewGraph

#: Observers are told of all poses so often until all views are joined: after each join of fifty
#: views or fewer. To put all poses together takes time with the number of views.
TOLD = 50


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
        Its own state stays as it is.
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
    untold: int = 0

    def __post_init__(self) -> None:
        self.models = self.search.models
        self.hypotheses = Hypotheses(self.models)
        self.settlement = Settlement(self.hypotheses, self.pipeline.judge)
        seeds = self.rng.bit_generator.seed_seq
        entropy = seeds.entropy  # type: ignore[attr-defined]
        self.entropy = tuple(entropy) if isinstance(entropy, Sequence) else (int(entropy),)
        self.spawn_key: tuple[int, ...] = tuple(seeds.spawn_key)  # type: ignore[attr-defined]

    def grow(self) -> None:
        """Join partial models as long as there is something to try, a round at a time."""
        while batch := self.search.batch():
            attempts = [self.attempt(*one) for one in batch]
            outcomes = self.pipeline.perform(attempts, self.models.views)
            for attempt, found in zip(attempts, outcomes, strict=True):
                if self.learn(attempt, found):
                    self.joined()
            for agreement, certainty in self.settlement.joined():
                self.record(agreement, certainty)
                self.joined()
        self.tell()

    def attempt(self, source: int, targets: Sequence[int]) -> Attempt:
        """All that an attempt to join two partial models needs, as they are now."""
        models = self.models
        moving, staying = (models.members(int(models.group[k])) for k in (source, targets[0]))
        members = (*moving.tolist(), *staying.tolist())
        place = {k: index for index, k in enumerate(members)}
        second = second_pair(models, self.search.scores, source, targets)
        return Attempt(
            members, len(moving), np.array([models.poses[k] for k in members]), place[source],
            tuple(place[k] for k in targets), second and (place[second[0]], place[second[1]]),
            self.known(members),
            self.entropy, self.spawn_key, self.min_probability,
        )  # fmt: skip

    def known(self, members: Sequence[int]) -> ViewGraph:
        """What a judge is told of accepted pairs: of these views, if it asks for loops alone."""
        if not isinstance(self.pipeline.judge, JointJudge):
            return self.graph  # Eq. (7) is over all that was accepted
        return self.graph.among({self.models.views[k].name for k in members})

    def learn(self, attempt: Attempt, found: Outcome) -> bool:
        """Join what an attempt has joined, or keep what it has found; says which."""
        views = [self.models.views[k] for k in attempt.members]
        for event in attempt.told(found, views):
            self.pipeline.emit(event)
        source, targets = attempt.members[attempt.source], [
            attempt.members[k] for k in attempt.targets
        ]  # fmt: skip
        own = len(self.pairs) + found.own
        self.pairs += found.pairs
        if self.models.group[source] == self.models.group[targets[0]]:
            self.close(source, targets[0], found.joint, own)
            return False
        if found.joint is not None and self.join(attempt, source, targets[0], found.joint, own):
            return True
        if found.joint is None:
            kept = self.hypotheses.add(
                source, targets[0], list(found.poses), found.probabilities.tolist(), own,
                found.plausibilities.tolist(), self.pairs[own].verdict.confidence,
            )  # fmt: skip
            if kept:
                best = max(kept, key=lambda one: one.probability)
                closing = closing_pair(self.hypotheses, best, self.search.registered)
                if closing is not None:
                    self.search.suggest(*closing)
        self.search.failed(source, targets)
        return False

    def join(self, attempt: Attempt, source: int, target: int, joint: Edge, own: int) -> bool:
        """Join two partial models, unless what has joined them meanwhile contradicts it."""
        models = self.models
        now = {k for end in (source, target) for k in models.members(int(models.group[end]))}
        if now != set(attempt.members):
            pair = self.pairs[own]
            verdict = consistent_join(
                models, self.pipeline.judge, source, target, joint.T_target_source, pair.verdict,
                self.min_probability,
            )  # fmt: skip
            self.pairs[own] = replace(pair, verdict=verdict)
            if not verdict.reliable:
                return False
        models.join(source, target, joint.T_target_source)
        self.graph = self.graph.with_edge(joint)
        return True

    def close(self, source: int, target: int, joint: Edge | None, own: int) -> None:
        """Take notice of a pose between partial models that were joined in the same round."""
        if joint is None:
            return
        view, pair = self.models.views[source], self.pairs[own]
        apart = rms_apart(
            compared(view), joint.T_target_source, self.models.relative(target, source)
        )
        if apart <= TOLERANCE * 2**0.5 * view.scale.resolution:
            self.graph = self.graph.with_edge(joint)
        else:
            reason = "it contradicts the pair that joined these partial models"
            verdict = replace(pair.verdict, reliable=False, reason=reason, open_loop=True)
            self.pairs[own] = replace(pair, verdict=verdict)

    def joined(self) -> None:
        """Take notice of a join; tell observers where the views are now, after so many."""
        self.search.joined()
        self.untold += 1
        if self.untold * TOLD > len(self.models.views):
            self.tell()

    def tell(self) -> None:
        """Tell observers where the views are, if they do not know."""
        if self.untold:
            self.untold = 0
            self.pipeline.revise(outcome(self.models, self.scores, self.pairs))

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
