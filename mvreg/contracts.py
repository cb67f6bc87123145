"""What a stage of each kind must do. A stage is a frozen dataclass: its fields are its parameters.

Stages are pure: no globals, no logging, no printing, and randomness only through `rng`. "No
candidate" is an empty `Candidates`, "found but doubtful" a `Verdict`; exceptions are for wrong
input. `mvreg.testing` has a contract suite for each kind.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from mvreg.types import (
    Array,
    Candidates,
    Features,
    Matches,
    Model,
    Registration,
    Result,
    Sample,
    Scan,
    ScanSet,
    Verdict,
    View,
)

if TYPE_CHECKING:
    from mvreg.pipeline import Pipeline


class Dataset(Protocol):
    """Finds scans."""

    def __call__(self, rng: np.random.Generator) -> ScanSet:
        """Load the scans; `rng` serves orders and motions drawn at random."""


class Downsample(Protocol):
    """Thins scans out, twice: points to refine on, and keypoints to search with."""

    def __call__(
        self, scans: Sequence[Scan], rng: np.random.Generator
    ) -> tuple[list[Sample], float]:
        """Return a sample per scan, and the spacing of the keypoints, common to all (length).

        It sees all the scans at once because the spacing must be one for the whole set.
        """


class Describe(Protocol):
    """Gives every keypoint a descriptor that does not change under rigid motion."""

    def __call__(self, scan: Scan, keypoints: Array, spacing: float) -> Features:
        """Describe `keypoints` (K, 3) of the scan; those that cannot be described are left out."""


class Seed(Protocol):
    """Proposes matches by descriptor alone."""

    def __call__(self, source: View, target: View) -> Matches:
        """Return seed matches, best first; may be empty."""


class Propagate(Protocol):
    """Turns seed matches into hypotheses for the pose."""

    def __call__(
        self, source: View, target: View, seeds: Matches, rng: np.random.Generator
    ) -> Candidates:
        """Return candidate poses ``T_target_source``, best first; may be empty."""


class Refine(Protocol):
    """Makes a coarse pose accurate."""

    def __call__(self, source: View, target: View, T_init: Array) -> Registration:
        """Return the pose near `T_init` (4, 4) that fits the source to the target best."""


class Judge(Protocol):
    """Says whether a registration can be relied on."""

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        accepted: Sequence[Registration],
    ) -> Verdict:
        """Judge `registration`, given those accepted so far."""


class Augment(Protocol):
    """Merges an accepted view into the model."""

    def __call__(self, model: Model, source: View, registration: Registration) -> Model:
        """Return the model with the source in it; the model frame stays."""


class Strategy(Protocol):
    """The outer loop: which pairs to register, in which order, and what to make of them."""

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        """Place as many of `views` as can be placed."""


class Adjust(Protocol):
    """Improves all the poses at once, after the loop."""

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        """Return the result with better poses of the same scans; the reference's stays.

        Every one of `Result.components` is improved too, by itself and in its own frame: the pose
        of its first scan stays. `mvreg.stages.adjust.over_components` does the loop.

        `pipeline` lends its stages, `pipeline.refine` above all. A `Result.model` does not fit the
        new poses: return None for it.
        """


KINDS: dict[str, type] = {
    "dataset": Dataset,
    "downsample": Downsample,
    "describe": Describe,
    "seed": Seed,
    "propagate": Propagate,
    "refine": Refine,
    "judge": Judge,
    "augment": Augment,
    "strategy": Strategy,
    "adjust": Adjust,
}
