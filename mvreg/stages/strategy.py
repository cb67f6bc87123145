"""The outer loop over the scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.errors import InputError
from mvreg.types import Array, Pair, Registration, Result, View

if TYPE_CHECKING:
    from mvreg.pipeline import Pipeline


def careful_levels() -> list[dict[str, Any]]:
    """First what overlaps well, then what overlaps less, at last with a wider search."""
    return [
        {"judge.min_overlap": 0.6},
        {"judge.min_overlap": 0.5},
        {"judge.min_overlap": 0.45, "seed.top_fraction": 1.0, "propagate.keep": 15},
    ]


def untouched(pipeline: Pipeline, name: str) -> bool:
    """Whether ``kind.parameter`` still has its default, or is none of a stage's parameters."""
    kind, _, parameter = name.partition(".")
    stage = getattr(pipeline, kind, None)
    if not is_dataclass(stage):
        return True
    defaults = {field.name: field.default for field in fields(stage)}
    return parameter not in defaults or getattr(stage, parameter) == defaults[parameter]


@dataclass(frozen=True)
class GrowStrategy:
    """Grow one model from the first scan: Algorithm 2 of the paper, repaired.

    Every scan still missing is registered to the model in turn; one judged reliable is merged in.
    The paper's loop never ends when a whole pass accepts nothing; here the next level of search
    parameters is tried then, and after the last level the scans left over are reported. Nor does
    the paper say how doubtful a scan may be early on, when the model is small and a wrong one does
    the most harm: the levels let those that overlap well come first.

    Parameters
    ----------
    levels : list of mappings
        Parameters by their dotted names, e.g. ``{seed.top_fraction: 1.0}``, that replace the
        pipeline's at each level; stages without such a parameter stay as they are, and so do
        parameters that were set to other than their defaults. ``[{}]`` is the paper's loop.
    """

    levels: list[dict[str, Any]] = field(default_factory=careful_levels)

    def __post_init__(self) -> None:
        if not self.levels:
            raise InputError("strategy.levels: expected at least one level, [{}]; got none")

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        pipelines = [
            pipeline.with_parameters({k: v for k, v in level.items() if untouched(pipeline, k)})
            for level in self.levels
        ]
        model = pipeline.begin(views[0])
        poses: dict[str, Array] = {views[0].name: np.eye(4)}
        waiting = list(views[1:])
        pairs: list[Pair] = []
        accepted: list[Registration] = []
        level = 0
        while waiting and level < len(pipelines):
            before = len(waiting)
            for view in list(waiting):
                registration, pair = pipelines[level].register(
                    view, model, accepted, rng.spawn(1)[0]
                )
                pairs.append(pair)
                if registration is None or not pair.verdict.reliable:
                    continue
                model = pipeline.extend(model, view, registration)
                poses[view.name] = registration.T_target_source
                accepted.append(registration)
                waiting.remove(view)
            level = 0 if len(waiting) < before else level + 1
        names = tuple(view.name for view in waiting)
        return Result(views[0].name, poses, names, tuple(pairs), model)
