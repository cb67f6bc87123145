"""What a stage of each kind must do. A stage is a frozen dataclass: its fields are its parameters.

Stages are pure: no globals, no logging, no printing, and randomness only through `rng`. "No
candidate" is an empty `Candidates`, "found but doubtful" a `Verdict`; exceptions are for wrong
input. `mvreg.testing` has a contract suite for each kind.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from mvreg.events import Emit
from mvreg.evidence.pooled import Evidence, Meeting
from mvreg.types import (
    Array,
    Candidates,
    Features,
    Matches,
    Model,
    Pair,
    Registration,
    Result,
    Sample,
    Scan,
    ScanSet,
    Verdict,
    View,
    ViewGraph,
)


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
        graph: ViewGraph,
    ) -> Verdict:
        """Judge `registration`, given the `graph` of the pairs accepted so far.

        The graph holds what the strategy relies on now, in the order in which it was accepted: not
        what was refused, nor what was taken back. Where it already leads from source to target,
        the registration closes a loop, see `ViewGraph.loop`.
        """


@runtime_checkable
class JointJudge(Judge, Protocol):
    """A judge that can weigh several view pairs together, as `mvreg.stages` has in ``evidence``."""

    def together(self, pairs: Sequence[Meeting]) -> Evidence:
        """Pool what `pairs` show: how probable it is that all of them are right, and why not."""


@runtime_checkable
class ScreeningJudge(Judge, Protocol):
    """A judge that can tell a hopeless pose from few points, before it is refined on all."""

    def hopeless(
        self, registration: Registration, few: View, target: View, graph: ViewGraph, factor: float
    ) -> bool:
        """Whether a pose refined on `few` of the source's points scores so badly.

        That is, worse than `factor` times the threshold; what it misses costs time, what it turns
        away is lost. A judge whose score is no residual need not have this: then no pose is turned
        away early.
        """


class Augment(Protocol):
    """Merges an accepted view into the model."""

    def __call__(self, model: Model, source: View, registration: Registration) -> Model:
        """Return the model with the source in it; the model frame stays."""


class Pipeline(Protocol):
    """The stages of a pair, and what a strategy or an adjustment may ask of them.

    `mvreg.Pipeline` is the implementation. It tells observers what happens: a strategy that
    registers, extends, places and revises by these methods need not.
    """

    @property
    def downsample(self) -> Downsample: ...
    @property
    def describe(self) -> Describe: ...
    @property
    def seed(self) -> Seed: ...
    @property
    def propagate(self) -> Propagate: ...
    @property
    def refine(self) -> Refine: ...
    @property
    def judge(self) -> Judge: ...
    @property
    def augment(self) -> Augment: ...
    @property
    def emit(self) -> Emit: ...

    def with_stages(self, **stages: Any) -> Pipeline:
        """The pipeline with other stages, by kind."""

    def with_parameters(self, changes: Mapping[str, Any]) -> Pipeline:
        """The pipeline with some stages' parameters replaced, by dotted names."""

    def register(
        self,
        source: View,
        target: View,
        graph: ViewGraph,
        rng: np.random.Generator,
        checks: Sequence[Callable[[Registration, Verdict], Verdict]] = (),
        give_up: float = np.inf,
    ) -> tuple[Registration | None, Pair]:
        """Register one view to another, or to the model (Algorithm 1)."""

    def begin(self, reference: View) -> Model:
        """Begin a model with a view, whose frame is the model's."""

    def extend(self, model: Model, source: View, registration: Registration) -> Model:
        """Merge a view into the model."""

    def revise(self, result: Result) -> None:
        """Tell observers of all the poses at once, instead of those told before."""

    def place(self, view: View, T_model_scan: Array) -> None:
        """Tell observers of a pose that needs no merging, as in a tree of scans."""


class Strategy(Protocol):
    """The outer loop: which pairs to register, in which order, and what to make of them.

    A parameter ``levels`` that is a list of mappings holds parameters of the other stages, by their
    dotted names: when a configuration is composed, what the user sets is taken out of them.
    """

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        """Place as many of `views` as can be placed."""


class Adjust(Protocol):
    """Improves all the poses at once, after the loop."""

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        """Return the result with better poses of the same scans; the reference's stays.

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
