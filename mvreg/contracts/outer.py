"""What the stages around the pairs must do: the loop over the scans, and what follows it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from mvreg.contracts.pipeline import Pipeline
from mvreg.types import Result, View


class Strategy(Protocol):
    """The outer loop: which pairs to register, in which order, and what to make of them.

    A parameter ``levels`` that is a list of mappings holds parameters of the other stages, by their
    dotted names: when a configuration is composed, what the user sets is taken out of them.
    """

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        """Place as many of `views` as can be placed.

        Every view is in exactly one of `Result.poses`, a component and `unregistered`; the order
        of `poses` is free, `pairs` are in the order in which they were tried.
        """


class Adjust(Protocol):
    """Improves all the poses at once, after the loop."""

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        """Return the result with better poses of the same scans; the reference's stays.

        Every one of `Result.components` is improved too, by itself and in its own frame: the pose
        of its first scan stays. `mvreg.stages.adjust.components.over_components` does the loop.

        `pipeline` lends its stages, `pipeline.refine` above all. A `Result.model` does not fit the
        new poses: return None for it.
        """
