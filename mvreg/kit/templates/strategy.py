"""Which pairs are registered, and in which order: ``strategy=nameless``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.errors import check_positive
from mvreg.types import Array, Edge, Pair, Result, View, ViewGraph


@dataclass(frozen=True)
class NamelessStrategy:
    """Grow one model from the scan with the most keypoints.

    Parameters
    ----------
    passes : int
        No more passes over the scans that are not placed yet than this. A pass that adds nothing
        is not the last: stages draw other random numbers in the next.
    """

    passes: int = 10

    def __post_init__(self) -> None:
        check_positive("strategy", passes=self.passes)

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        """Place as many views as can be placed.

        Returns
        -------
        Result
            Poses ``T_model_scan`` (4, 4), in the frame of the scan that the model began with, and
            the names of the views that are not placed.
        """
        first = max(views, key=lambda view: len(view.features.keypoints))
        waiting = [view for view in views if view is not first]
        model, graph = pipeline.begin(first), ViewGraph()
        poses: dict[str, Array] = {first.name: np.eye(4)}
        pairs: list[Pair] = []
        for _ in range(self.passes):
            left = []
            for view in waiting:
                found, pair = pipeline.register(view, model, graph, rng.spawn(1)[0])
                pairs.append(pair)
                if found is None or not pair.verdict.reliable:
                    left.append(view)
                    continue
                graph = graph.with_edge(Edge.of(found, view, model))
                model = pipeline.extend(model, view, found)
                poses[view.name] = found.T_target_source
            waiting = left
            if not waiting:
                break
        return Result(first.name, poses, tuple(v.name for v in waiting), tuple(pairs), model)
