"""Register and integrate the scans one by one, in the order given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.stages.strategy.grow import Growth
from mvreg.types import Result, View


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
        growth = Growth(views[0], pipeline)
        return growth.result([v for v in views[1:] if not growth.takes_in(v, pipeline, rng)])
