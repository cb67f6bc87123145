"""Most promising first: partial models grow from every scan, and are joined where all agrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mvreg.contracts import Judge, Pipeline
from mvreg.errors import check_ascending, check_positive
from mvreg.evidence.view_pair import witness
from mvreg.geometry import se3
from mvreg.parallel import in_threads
from mvreg.stages.strategy.best_first.joint_verdict import beside_its_turns, doubt, together
from mvreg.stages.strategy.best_first.loop_closure import LoopClosure
from mvreg.stages.strategy.best_first.overlap_score import promise
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.stages.strategy.best_first.search import Search
from mvreg.types import Array, Edge, Pair, Registration, Result, Verdict, View, ViewGraph

#: Scans that were taken back get so many further rounds of attempts.
ROUNDS = 2


@dataclass(frozen=True)
class BestFirst:
    """Try the most promising pair next, let partial models grow from every scan, and join them.

    Every scan begins as a partial model of its own. The scan that promises most is registered to
    the views of another partial model that look most like it, merged; if the judge relies on it,
    and nothing that the two partial models show of each other speaks against it, they become one
    (Kruskal's algorithm, as Huber and Hebert 2003 use it, on promises instead of registrations).
    There is no first scan that everything hangs on. At the end every scan is weighed against all
    that it meets: what is contradicted is taken back, and tried again.

    The largest partial model becomes the result's `poses`, in the frame of the scan that promises
    most within it; the others of two scans or more become its `components`.

    Parameters
    ----------
    radii : list of float
        Of the descriptors that promises are told from, in units of the keypoints' spacing.
    neighbours : int
        Votes of a keypoint, see `mvreg.stages.strategy.best_first.overlap_score`.
    parts : int
        Views that are merged to one target; after every second failure of a source so many more.
    patience : int
        A partial model that failed so often, and once more for every further scan that it has, is
        not moved any more; others may still be moved to it.
    min_probability : float
        What all scans together say of a join, and of each scan at the end, must be as probable; of
        a judge that cannot pool, see `together`, it is the share of points in reliable pairs.
    """

    radii: list[float] = field(default_factory=lambda: [1.0, 2.0, 3.0])
    neighbours: int = 5
    parts: int = 3
    patience: int = 10
    min_probability: float = 0.5

    def __post_init__(self) -> None:
        check_ascending("strategy", radii=self.radii)
        check_positive(
            "strategy", neighbours=self.neighbours, parts=self.parts, patience=self.patience
        )

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        in_threads(witness, views)  # made ready side by side, not when first weighed
        promises = promise(views, self.radii, self.neighbours)
        models = PartialModels(views)
        search = Search(promises, models, self.parts, self.patience)
        pairs: list[Pair] = []
        graph = ViewGraph()
        loops = LoopClosure(search, pipeline, pairs, rng)
        pipeline.begin(views[int(promises.sum(axis=1).argmax())])
        for _ in range(ROUNDS):
            graph = self.grow(search, pipeline, pairs, promises, graph, loops, rng)
            taken = self.take_back(models, pipeline.judge)
            graph = graph.without({views[k].name for k in taken})
            if not taken:
                break
            search.failures[taken] = np.minimum(search.failures[taken], self.patience - 1)
        result = outcome(models, promises, pairs)
        pipeline.revise(result)
        return result

    def grow(
        self,
        search: Search,
        pipeline: Pipeline,
        pairs: list[Pair],
        promises: Array,
        graph: ViewGraph,
        loops: LoopClosure,
        rng: np.random.Generator,
    ) -> ViewGraph:
        """Join partial models as long as there is something to try; `pairs` gets every attempt."""
        models = search.models
        while (found := search.next()) is not None:
            source, targets = found
            target = models.target(targets, pipeline)
            view = models.views[source]
            checks = (
                beside_its_turns(pipeline, view, target, graph),
                partial(self.agreed, models, pipeline.judge, source, targets[0]),
                loops.check(source, targets, graph),
            )
            registration, pair = pipeline.register(view, target, graph, rng.spawn(1)[0], checks)
            pairs.append(replace(pair, target=models.views[targets[0]].name))
            if registration is None or not pair.verdict.reliable:
                search.failed(source, targets)
                continue
            models.join(source, targets[0], registration.T_target_source)
            graph = graph.with_edge(Edge.of(registration, view, target))
            search.joined()
            pipeline.revise(outcome(models, promises, pairs))
        return graph

    def agreed(
        self,
        models: PartialModels,
        judge: Judge,
        source: int,
        target: int,
        registration: Registration,
        verdict: Verdict,
    ) -> Verdict:
        """The verdict, unless the views that move along with the source speak against it."""
        moving = models.members(int(models.group[source]))
        if not verdict.reliable or len(moving) == 1:
            return verdict
        staying = models.members(int(models.group[target]))
        trial = models.copy()
        trial.join(source, target, registration.T_target_source)
        found = together(judge, trial.meetings(moving.tolist(), staying.tolist()))
        if found.probability >= self.min_probability:
            return verdict
        reason = f"the other scans of the partial models object: {found.reason}"
        return replace(verdict, reliable=False, reason=reason)

    def take_back(self, models: PartialModels, judge: Judge) -> list[int]:
        """Take every view out of its group that all it meets there speaks against; which ones."""
        taken: list[int] = []
        for members in models.groups():
            left = waiting = members.tolist()
            met, doubts = models.met_by(left), dict[int, float]()
            while len(left) > 1:
                weighed = in_threads(partial(doubt, judge), [met[k] for k in waiting])
                doubts.update(zip(waiting, weighed, strict=True))
                worst = max(left, key=lambda k: doubts[k])
                if doubts[worst] <= 1 - self.min_probability:
                    break
                left = [k for k in left if k != worst]
                waiting = [k for k in left if any(m in met[worst] for m in met[k])]
                met = {k: [m for m in met[k] if m not in met[worst]] for k in left}
                models.leave(worst)
                taken.append(worst)
        return taken


def outcome(models: PartialModels, promises: Array, pairs: Sequence[Pair]) -> Result:
    """The result that partial models amount to: each in the frame of its most promising view."""
    largest, *others = models.groups()
    components = []
    for members in (largest, *(one for one in others if len(one) > 1)):
        inside = promises[np.ix_(members, members)].sum(axis=1)
        first = int(members[int(inside.argmax())])
        order = [first, *(int(k) for k in members if k != first)]
        frame = se3.invert(models.poses[first])
        poses = {models.views[k].name: frame @ models.poses[k] for k in order}
        poses[models.views[first].name] = np.eye(4)
        components.append(poses)
    left = tuple(models.views[one[0]].name for one in others if len(one) == 1)
    reference = next(iter(components[0]))
    return Result(reference, components[0], left, tuple(pairs), components=tuple(components[1:]))
