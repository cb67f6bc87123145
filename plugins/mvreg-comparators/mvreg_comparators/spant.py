"""SpanT: a spanning tree grown breadth first under a dual criterion (Zhu et al. 2016)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.geometry import se3
from mvreg.stages import TmseJudge
from mvreg.types import Array, Edge, Pair, Registration, Result, View, ViewGraph
from mvreg_comparators.dual import DualCriterion


@dataclass(eq=False)
class Growth:
    """A tree of scans on its way: its poses, and what has been tried and taken in so far."""

    poses: dict[str, Array]
    waiting: list[View]
    pairs: list[Pair] = field(default_factory=list)
    graph: ViewGraph = field(default_factory=ViewGraph)
    smaller: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class SpanningTreeStrategy(DualCriterion):
    """Grow a spanning tree of scans from the first, each pair registered both ways: SpanT.

    Zhu, Guo, Li, Jin, Li and Liu 2016, "Automatic multi-view registration of unordered range
    scans without feature extraction", Neurocomputing 171; after the lab's published code. Breadth
    first: to each scan in the tree, in the order in which they came, every scan outside it is
    registered, then it to that scan, and the scan is taken in if both agree, see `DualCriterion`.
    There m is the mean resolution of the down-sampled scans at first, then the mean over the pairs
    taken of the smaller TMSE. Without (1) there is no way back. Both directions count as
    registrations. What no scan in the tree takes in is reported.

    Where the texts at hand are silent: the pairs are registered by the composed method's own
    stages, not by the paper's.

    Parameters
    ----------
    first_factor, either_factor, motion_factor, max_rotation, reference_resolution
        As in `DualCriterion`.
    judged : bool
        Whether both registrations must be reliable to the composed judge as well, which is not in
        the paper. Else that judge is not asked: the verdicts recorded are those of (1).
    """

    judged: bool = False

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        if not self.judged:
            pipeline = pipeline.with_stages(judge=self.first_criterion())
        pipeline.begin(views[0])
        first = float(np.mean([view.resolution for view in views]))
        unit = self.unit(views[0])
        growth = Growth({views[0].name: np.eye(4)}, list(views[1:]))
        growing = deque(views[:1])
        while growing and growth.waiting:
            target = growing.popleft()
            for source in list(growth.waiting):
                level = float(np.mean(growth.smaller)) / unit if growth.smaller else first
                if not self.meet(source, target, pipeline, growth, level, rng):
                    continue
                pose = growth.poses[target.name] @ growth.graph.edges[-1].T_target_source
                growth.poses[source.name] = se3.project(pose)
                pipeline.place(source, growth.poses[source.name])
                growth.waiting.remove(source)
                growing.append(source)
        left = tuple(view.name for view in growth.waiting)
        return Result(views[0].name, growth.poses, left, tuple(growth.pairs))

    def first_criterion(self) -> TmseJudge:
        """Criterion (1) as a judge."""
        factor = self.first_factor
        return TmseJudge(factor, factor, reference_resolution=self.reference_resolution)

    def meet(
        self,
        source: View,
        target: View,
        pipeline: Pipeline,
        growth: Growth,
        level: float,
        rng: np.random.Generator,
    ) -> bool:
        """Register two views both ways; whether the dual criterion holds, for m = `level`."""
        there = self.attempt(source, target, pipeline, growth, rng)
        if there is None or not self.fits(there, source, level):
            return False
        back = self.attempt(target, source, pipeline, growth, rng)
        if back is None or not self.agree(there, back, source, level):
            return False
        growth.graph = growth.graph.with_edge(Edge.of(there, source, target))
        growth.smaller.append(min(there.trimmed_mse, back.trimmed_mse))
        return True

    def attempt(
        self,
        source: View,
        target: View,
        pipeline: Pipeline,
        growth: Growth,
        rng: np.random.Generator,
    ) -> Registration | None:
        """Register one view to another; None if there is nothing, or nothing to rely on."""
        found, pair = pipeline.register(source, target, growth.graph, rng.spawn(1)[0])
        growth.pairs.append(pair)
        return None if self.judged and not pair.verdict.reliable else found
