"""Close a loop before partial models are joined by a pose that is not nearly certain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.stages.strategy.best_first.joint_verdict import Check
from mvreg.stages.strategy.best_first.search import Search
from mvreg.types import Array, Edge, Pair, Registration, Verdict, ViewGraph

#: A join of two partial models, of two views or more each, is nearly certain from this confidence
#: on, or where the judge tells none. Of 136 such joins in 48 runs on Bunny, Dragon, Buddha and the
#: figurine, all of them right, 13 have less: ``experiments/accuracy/joins.py``.
CERTAIN = 0.98
#: Sets random numbers for closing pairs apart from all that `rng.spawn` gives.
APART = 0x100F


class LoopClosure:
    """Registers a second pair between two partial models, which closes a loop with the first.

    A wrong pose of one pair may look right, on a surface that repeats itself; then a pair of other
    views, registered independently, is unlikely to agree with it. If the second pair is reliable by
    itself and the loop through both does not close, the join is refused: one of them is wrong, and
    nothing says which (Huber and Hebert 2003 call such cycles inconsistent).

    Parameters
    ----------
    search : Search
    pipeline : Pipeline
    pairs : list of Pair
        Gets the second pairs, too.
    rng : numpy.random.Generator
        Its own state stays as it is.
    """

    def __init__(
        self, search: Search, pipeline: Pipeline, pairs: list[Pair], rng: np.random.Generator
    ) -> None:
        self.search, self.pipeline, self.pairs = search, pipeline, pairs
        self.seeds = rng.bit_generator.seed_seq
        self.count = 0

    def check(self, source: int, targets: Sequence[int], graph: ViewGraph) -> Check:
        """A check of a reliable pose of view `source` in the frame of the first of `targets`."""

        def check(registration: Registration, verdict: Verdict) -> Verdict:
            if not verdict.reliable or not doubtful(verdict):
                return verdict
            ends = self.second(source, targets)
            if ends is None:
                return verdict
            models = self.search.models
            first, second = models.views[source], models.views[targets[0]]
            edge = Edge(first.name, second.name, registration.T_target_source)
            return self.closed(ends, graph.with_edge(edge), verdict)

        return check

    def closed(self, ends: tuple[int, int], graph: ViewGraph, verdict: Verdict) -> Verdict:
        """The verdict, unless a reliable pair of the views `ends` contradicts the graph."""
        models, pipeline = self.search.models, self.pipeline
        moving, staying = ends
        view, target = models.views[moving], models.target([staying], pipeline)
        _, pair = pipeline.register(view, target, graph, self.draw())
        self.pairs.append(replace(pair, target=models.views[staying].name))
        if not pair.verdict.open_loop:
            return verdict
        reason = f"the loop through {view.name} and {models.views[staying].name} does not close"
        return replace(verdict, reliable=False, reason=reason, open_loop=True)

    def second(self, source: int, targets: Sequence[int]) -> tuple[int, int] | None:
        """The pair of other views of the two partial models that promises most; None for none."""
        models = self.search.models
        moving = models.members(int(models.group[source]))
        staying = models.members(int(models.group[targets[0]]))
        if len(moving) < 2 or len(staying) < 2:
            return None
        worth: Array = self.search.scores[np.ix_(moving, staying)].copy()
        worth[moving == source] = 0.0
        worth[:, np.isin(staying, targets[:1])] = 0.0
        if not worth.max() > 0:
            return None
        row, column = np.unravel_index(int(worth.argmax()), worth.shape)
        return int(moving[row]), int(staying[column])

    def draw(self) -> np.random.Generator:
        """Random numbers of its own for the next pair."""
        self.count += 1
        seeds = self.seeds
        key = (*seeds.spawn_key, APART, self.count)  # type: ignore[attr-defined]
        own = np.random.SeedSequence(seeds.entropy, spawn_key=key)  # type: ignore[attr-defined]
        return np.random.default_rng(own)


def doubtful(verdict: Verdict) -> bool:
    """Whether a reliable pose is less than nearly certain."""
    return verdict.confidence is not None and verdict.confidence < CERTAIN
