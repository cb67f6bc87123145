"""Attempts at joining partial models, made side by side before their turn comes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from mvreg.events import Event, PairRegistered
from mvreg.parallel import in_threads, spare, threads
from mvreg.pipeline import Pipeline
from mvreg.stages.best_first_search import Search
from mvreg.types import Pair, Registration

#: Attempts made at once, for each thread: they take unequal times.
EACH = 2

Made = tuple[Registration | None, Pair]
#: What makes an attempt: a view to move, the views to move it to, the stages, what is random.
Make = Callable[[int, Sequence[int], Pipeline, np.random.Generator], Made]


@dataclass(frozen=True, eq=False)
class Attempt:
    """What came of an attempt, what observers are to be told of it, and what it rests on.

    `groups` are the labels of the two partial models as they were.
    """

    made: Made
    events: tuple[Event, ...]
    groups: frozenset[int]


class Attempts:
    """The attempts that a search asks for, some of them made before they are asked for.

    An attempt rests on two partial models, and on nothing else: its random numbers follow from the
    views that it is about. So those that do not share a partial model are made side by side, and
    kept until their turn comes or one of their partial models changes. Whatever the number of
    threads, the search gets the same answers in the same order.

    Parameters
    ----------
    search : Search
    pipeline : Pipeline
    make : callable
        ``make(source, targets, pipeline, rng)`` gives the registration and the pair.
    rng : numpy.random.Generator
        Drawn from once.
    """

    def __init__(
        self, search: Search, pipeline: Pipeline, make: Make, rng: np.random.Generator
    ) -> None:
        self.search, self.pipeline, self.make = search, pipeline, make
        self.number = int(rng.integers(2**63))
        self.ready: dict[tuple[int, ...], Attempt] = {}

    def next(self) -> tuple[int, list[int], Made] | None:
        """The view to move, the views to move it to, and what came of it; None at the end."""
        found = self.search.next()
        if found is None:
            return None
        source, targets = found
        if (source, *targets) not in self.ready:
            self.prepare(source, targets)
        attempt = self.ready.pop((source, *targets))
        for event in attempt.events:
            self.pipeline.emit(event)
        return source, targets, attempt.made

    def prepare(self, source: int, targets: list[int]) -> None:
        """Make this attempt, and those that may come next, as far as there are threads for them."""
        todo = [(source, targets)]
        if spare():
            ahead = (one for one in self.search.ahead() if (one[0], *one[1]) not in self.ready)
            todo = list(islice(ahead, EACH * threads()))  # this one comes first
        if len(todo) == 1:
            self.ready[source, *targets] = self.attempt(source, targets, self.pipeline.emit)
            return
        before = time.perf_counter()
        made = in_threads(lambda one: self.attempt(*one), todo)
        # Side by side they took less time than each by itself says.
        alone = sum(sum(one.made[1].seconds.values()) for one in made)
        share = min(1.0, (time.perf_counter() - before) / max(alone, 1e-9))
        for (moved, still), one in zip(todo, made, strict=True):
            self.ready[moved, *still] = shortened(one, share)

    def attempt(
        self, source: int, targets: Sequence[int], emit: Callable[[Event], None] | None = None
    ) -> Attempt:
        """One attempt; observers are told at once, if `emit` is given, or when its turn comes."""
        told = list[Event]()
        group = self.search.models.group
        groups = frozenset((int(group[source]), int(group[targets[0]])))
        pipeline = self.pipeline.observed_by(emit or told.append)
        rng = np.random.default_rng([self.number, source, *targets])
        return Attempt(self.make(source, targets, pipeline, rng), tuple(told), groups)

    def changed(self, *groups: int) -> None:
        """Forget the attempts that rest on partial models which are no longer what they were."""
        self.ready = {key: one for key, one in self.ready.items() if one.groups.isdisjoint(groups)}


def shortened(attempt: Attempt, share: float) -> Attempt:
    """The attempt, its stages having taken so much less time."""
    registration, pair = attempt.made
    less = replace(pair, seconds={stage: share * t for stage, t in pair.seconds.items()})
    events = tuple(
        replace(event, pair=less) if isinstance(event, PairRegistered) else event
        for event in attempt.events
    )
    return replace(attempt, made=(registration, less), events=events)
