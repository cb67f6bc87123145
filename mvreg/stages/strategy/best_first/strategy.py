"""Best first: partial models grow from every scan, and are joined where all evidence agrees."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

import numpy as np

from mvreg.contracts import Judge, Pipeline
from mvreg.errors import check_ascending, check_positive
from mvreg.evidence.view_pair import surface_samples
from mvreg.parallel import in_threads
from mvreg.stages.strategy.best_first.growth import Growth
from mvreg.stages.strategy.best_first.initial import join_fixed, with_initial_overlap
from mvreg.stages.strategy.best_first.joint_verdict import error_probability
from mvreg.stages.strategy.best_first.outcome import outcome
from mvreg.stages.strategy.best_first.overlap_score import Scores
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.stages.strategy.best_first.search import Search
from mvreg.stages.strategy.best_first.settlement import LEAST_POOLED
from mvreg.types import Result, View

#: Scans that were withdrawn get so many further rounds of attempts.
ROUNDS = 2


@dataclass(frozen=True)
class BestFirst:
    """Try the most promising pairs next, let partial models grow from every scan, and join them.

    Every scan begins as a partial model of its own. In rounds, as in Boruvka's algorithm for
    spanning trees, the most promising scan of each is registered to the views of another partial
    model that look most like it, merged; if the judge relies on it, and no other pair of scans of
    the two partial models contradicts it, they become one (as Huber and Hebert 2003 grow theirs, on
    overlap scores instead of registrations). The attempts of a round are worked on side by side;
    which they are, and what comes of them, does not depend on how many work. The result does not
    depend on a first scan. At the end every scan is checked
    against all scans that it overlaps: what is contradicted is withdrawn, and tried again.

    The largest partial model becomes the result's `poses`, in the frame of the
    most promising scan within it; the others of two scans or more become its `components`.

    Parameters
    ----------
    radii : list of float
        Of the descriptors that overlap scores are computed from, in units of the keypoints'
        spacing.
    neighbours : int
        Votes of a keypoint, see `mvreg.stages.strategy.best_first.overlap_score`.
    parts : int
        Views that are merged to one target; after every second failure of a source so many more.
    max_failures : int
        A partial model that failed so often, and once more for every further scan that it has, is
        not moved any more; others may still be moved to it.
    min_probability : float
        What all scans together say of a join, and of each scan at the end, must be as probable; of
        a judge that cannot pool, see `together`, it is the share of points in reliable pairs.
    """

    radii: list[float] = field(default_factory=lambda: [1.0, 2.0, 3.0])
    neighbours: int = 10
    parts: int = 3
    max_failures: int = 10
    min_probability: float = 0.5
    holds_fixed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_ascending("strategy", radii=self.radii)
        check_positive(
            "strategy", neighbours=self.neighbours, parts=self.parts, max_failures=self.max_failures
        )

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        in_threads(surface_samples, views)  # prepared in parallel, not when first needed
        task = Scores(tuple(range(len(views))), tuple(self.radii), self.neighbours)
        (scores,) = pipeline.perform([task], views)
        scores = with_initial_overlap(scores, views)
        models = PartialModels(views)
        held = join_fixed(models)
        search = Search(scores, models, self.parts, self.max_failures)
        growth = Growth(search, pipeline, scores, rng, self.min_probability)
        pipeline.begin(views[int(scores.sum(axis=1).argmax())])
        for _ in range(ROUNDS):
            growth.grow()
            supported = growth.settlement.supported
            withdrawn = self.withdraw(models, pipeline.judge, supported, held)
            growth.graph = growth.graph.without({views[k].name for k in withdrawn})
            if not withdrawn:
                break
            search.failures[withdrawn] = np.minimum(
                search.failures[withdrawn], self.max_failures - 1
            )
        result = outcome(models, scores, growth.pairs)
        pipeline.revise(result)
        return result

    def withdraw(
        self,
        models: PartialModels,
        judge: Judge,
        supported: Collection[int] = (),
        held: Collection[int] = (),
    ) -> list[int]:
        """Withdraw every view that the evidence of its group contradicts; return which.

        Of views that pairs in agreement `supported` less is asked; those `held` stay.
        """
        least = dict.fromkeys(supported, LEAST_POOLED) | dict.fromkeys(held, -np.inf)
        withdrawn: list[int] = []
        for members in models.groups():
            left = waiting = members.tolist()
            incident, error_probabilities = models.incident_pairs(left), dict[int, float]()
            while len(left) > 1:
                weighed = in_threads(
                    partial(error_probability, judge), [incident[k] for k in waiting]
                )
                error_probabilities.update(zip(waiting, weighed, strict=True))
                worst = max(
                    left, key=lambda k: error_probabilities[k] + least.get(k, self.min_probability)
                )
                if error_probabilities[worst] <= 1 - least.get(worst, self.min_probability):
                    break
                left = [k for k in left if k != worst]
                waiting = [k for k in left if any(m in incident[worst] for m in incident[k])]
                incident = {k: [m for m in incident[k] if m not in incident[worst]] for k in left}
                models.leave(worst)
                withdrawn.append(worst)
        return withdrawn
