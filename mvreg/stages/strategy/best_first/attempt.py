"""One attempt to join two partial models: what it needs, and what comes out of it.

It depends on nothing else: any number of them can be worked on side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.events import Event, PairRegistered, PairStarted
from mvreg.stages.strategy.best_first.attempted import Outcome, Registered, without_pairs
from mvreg.stages.strategy.best_first.joint_verdict import (
    Check,
    checked_for_other_side,
    checked_for_symmetry,
    consistent_join,
)
from mvreg.stages.strategy.best_first.loop_closure import doubtful
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.stages.strategy.best_first.second_look import looked_at_again, with_answers
from mvreg.types import (
    Array,
    Candidates,
    Edge,
    Matches,
    Pair,
    Registration,
    Verdict,
    View,
    ViewGraph,
)

#: Entropy and spawn key of a `numpy.random.SeedSequence`.
Randomness = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Attempt:
    """Register a view to views of another partial model, and judge it by all that both know.

    Views are told by their positions among `members`.

    Parameters
    ----------
    members : tuple of int
        The views of the two partial models, by their positions among all: those of the one that
        moves, `count` of them, then those of the other.
    count : int
    poses : (M, 4, 4) array
        ``T_group_view`` of the members, each in the frame of its own partial model.
    source : int
        The view to register.
    targets : tuple of int
        The views that it is registered to, merged; the pose is in the frame of the first.
    second : (int, int) or None
        Another pair of the two, which closes a loop where the first is less than nearly certain.
    graph : ViewGraph
        The accepted pairs within the two.
    entropy, spawn_key : tuple of int
        What the run's random numbers follow from.
    min_probability : float
        See `BestFirst`.
    """

    kinds: ClassVar[tuple[str, ...]] = ("seed", "propagate", "refine", "judge", "augment")
    answers: ClassVar[tuple[type, ...]] = (Outcome, Registered)

    members: tuple[int, ...]
    count: int
    poses: Array
    source: int
    targets: tuple[int, ...]
    second: tuple[int, int] | None
    graph: ViewGraph
    entropy: Randomness
    spawn_key: Randomness
    min_probability: float

    def __call__(self, views: Sequence[View], pipeline: Pipeline) -> Outcome:
        """Make the attempt; `views` are the members, in their order."""
        return Work(self, views, pipeline).outcome()

    def told(self, found: Outcome, views: Sequence[View]) -> list[Event]:
        """What observers are to be told of an outcome.

        Of one that was kept the target is the first of the views that were merged to it.
        """
        if found.events or not found.registered:
            return list(found.events)
        started: list[Event] = []
        ended: list[Event] = []
        for one in found.registered:
            ends = views[one.source], views[one.target]
            started.insert(0, PairStarted(*ends))  # another may have begun before it ended
            ended.append(
                PairRegistered(*ends, Matches.none(), Candidates.none(), one.registration, one.pair)
            )
        return [*started, *ended]

    def models(self, views: Sequence[View]) -> PartialModels:
        """The two partial models, of views that are told by their positions among the members."""
        models = PartialModels(views)
        models.poses = list(self.poses)
        models.group = np.where(np.arange(len(views)) < self.count, 0, 1)
        return models

    def draw(self, *views: int) -> np.random.Generator:
        """Random numbers for some of the members, whatever else is registered, and when."""
        key = (*self.spawn_key, *(self.members[k] for k in views))
        return np.random.default_rng(np.random.SeedSequence(self.entropy, spawn_key=key))


@dataclass
class Work:
    """An attempt while it is made."""

    attempt: Attempt
    views: Sequence[View]
    pipeline: Pipeline
    events: list[Event] = field(default_factory=list)
    pairs: list[Pair] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.pipeline = self.pipeline.observed_by(self.events.append)
        self.models = self.attempt.models(self.views)

    def outcome(self) -> Outcome:
        """Register, judge, and look again at what is refused."""
        attempt, views = self.attempt, self.views
        first = views[attempt.targets[0]]
        target, source = self.models.target(attempt.targets, self.pipeline), views[attempt.source]
        checks = (
            checked_for_symmetry(self.pipeline, source, target, attempt.graph),
            checked_for_other_side(source, target),
            self.consistent,
            self.closing,
        )
        rng = attempt.draw(attempt.source, *attempt.targets)
        registration, pair = self.pipeline.register(source, target, attempt.graph, rng, checks)
        own = len(self.pairs)
        self.pairs.append(replace(pair, target=first.name))
        poses, said = np.empty((0, 4, 4)), np.empty((0, 2))
        if registration is not None and not pair.verdict.reliable:
            found, likely, plausible = looked_at_again(self.pipeline, registration, source, target)
            registration = self.chosen(found, likely, own, source, target, checks)
            self.pairs[own] = with_answers(self.pairs[own], source, found, likely, plausible)
            poses = np.array([one.T_target_source for one in found])
            said = np.column_stack([likely, plausible])
        joint = None if registration is None else Edge.of(registration, source, target)
        return Outcome(
            tuple(self.pairs), own, joint, poses, said[:, 0], said[:, 1], self.registered(),
            tuple(self.events),
        )  # fmt: skip

    def registered(self) -> tuple[Registered, ...]:
        """The registrations, as they can be kept."""
        place = {view.name: k for k, view in enumerate(self.views)}
        return tuple(
            Registered(
                place[event.pair.source], place[event.pair.target],
                event.registration and without_pairs(event.registration), event.pair,
            )
            for event in self.events
            if isinstance(event, PairRegistered)
        )  # fmt: skip

    def chosen(
        self,
        found: Sequence[Registration],
        likely: Sequence[float],
        own: int,
        source: View,
        target: View,
        checks: Sequence[Check],
    ) -> Registration | None:
        """The most probable of the poses of a refused attempt, if it can be relied on."""
        best = int(np.argmax(likely))
        if best == 0:
            return None
        others = [one.T_target_source for k, one in enumerate(found) if k != best]
        chosen = replace(found[best], alternatives=np.array(others))
        verdict = self.pipeline.judge(chosen, source, target, self.attempt.graph)
        for check in checks:
            verdict = check(chosen, verdict)
        self.pairs[own] = replace(
            self.pairs[own], verdict=verdict, T_target_source=chosen.T_target_source,
            overlap=chosen.overlap, trimmed_mse=chosen.trimmed_mse,
        )  # fmt: skip
        return chosen if verdict.reliable else None

    def consistent(self, registration: Registration, verdict: Verdict) -> Verdict:
        """The verdict, unless the views that move along with the source speak against it."""
        attempt = self.attempt
        if not verdict.reliable or attempt.count == 1:
            return verdict
        return consistent_join(
            self.models, self.pipeline.judge, attempt.source, attempt.targets[0],
            registration.T_target_source, verdict, attempt.min_probability,
        )  # fmt: skip

    def closing(self, registration: Registration, verdict: Verdict) -> Verdict:
        """The verdict, unless a second pair, registered for it, contradicts a doubtful pose."""
        if not verdict.reliable or not doubtful(verdict) or self.attempt.second is None:
            return verdict
        moving, staying = (self.views[k] for k in self.attempt.second)
        ends = self.views[self.attempt.source].name, self.views[self.attempt.targets[0]].name
        graph = self.attempt.graph.with_edge(Edge(*ends, registration.T_target_source))
        target = self.models.target([self.attempt.second[1]], self.pipeline)
        rng = self.attempt.draw(*self.attempt.second)
        _, pair = self.pipeline.register(moving, target, graph, rng)
        self.pairs.append(replace(pair, target=staying.name))
        if not pair.verdict.open_loop:
            return verdict
        reason = f"the loop through {moving.name} and {staying.name} does not close"
        return replace(verdict, reliable=False, reason=reason, open_loop=True)
