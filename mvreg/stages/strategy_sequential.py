"""Align and integrate the scans one by one, in the order given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mvreg.types import Array, Pair, Registration, Result, View

if TYPE_CHECKING:
    from mvreg.pipeline import Pipeline


@dataclass(frozen=True)
class SequentialStrategy:
    """Register each scan, in the order given, to the model of those before it, and merge it in.

    After Chen and Medioni 1992, "Object modelling by registration of multiple range images", who
    know the motions roughly; here the pipeline's search finds them. They have no doubts either; a
    scan that the judge refuses is here left out and reported, never forced in, and not tried
    again. For scans that come in the order of the sensor's path; `GrowStrategy` is for the others.
    """

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        model = pipeline.begin(views[0])
        poses: dict[str, Array] = {views[0].name: np.eye(4)}
        pairs: list[Pair] = []
        accepted: list[Registration] = []
        refused: list[str] = []
        for view in views[1:]:
            registration, pair = pipeline.register(view, model, accepted, rng.spawn(1)[0])
            pairs.append(pair)
            if registration is None or not pair.verdict.reliable:
                refused.append(view.name)
                continue
            model = pipeline.extend(model, view, registration)
            poses[view.name] = registration.T_target_source
            accepted.append(registration)
        return Result(views[0].name, poses, tuple(refused), tuple(pairs), model)
