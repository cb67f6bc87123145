"""What a stage of each kind must do. A stage is a frozen dataclass: its fields are its parameters.

Stages are pure: no globals, no logging, no printing, and randomness only through `rng`. "No
candidate" is an empty `Candidates`, "found but doubtful" a `Verdict`; exceptions are for wrong
input. `mvreg.testing` has a contract suite for each kind. Records check themselves when they are
made, and a run checks every answer against what was asked: a stage that raises anything but an
`MvregError`, or answers what cannot be, ends the run with a `StageError` that names it.

What holds for all of them:

- Arrays are shared between records, may be read-only, and must not be written to.
- A view may have no point, one, or all in one place, and no keypoint; so may the model.
- Same arguments and same random numbers, same answer to the last bit, whatever the number of
  threads. Who calls several times with randomness spawns a generator per call from its own,
  in a fixed order: ``rng.spawn(1)[0]``.
- `describe` and `refine` are called from several threads at once. The order of the answers, and of
  the events, is that of the input.

A run emits, in this order: `RunStarted` (the command line only); a `ViewPrepared` per scan, in
their order; what the strategy makes of them; `AdjustStarted`; `RunFinished` (the command line
only). In the strategy's part a `PairStarted` is followed by its `PairRegistered`, and a pair that
is registered to check the first stands between the two; growing a model
begins with `ReferenceChosen` and has a `ViewPlaced` after each pair that is accepted. `Pipeline`
emits all of these but the first and the last two; a stage emits by its methods only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from mvreg.events import Emit
from mvreg.evidence.pooled import Evidence, ViewPair
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

__all__ = [
    "KINDS",
    "Adjust",
    "Augment",
    "Dataset",
    "Describe",
    "Downsample",
    "JointJudge",
    "Judge",
    "Pipeline",
    "Propagate",
    "Refine",
    "ScreeningJudge",
    "Seed",
    "Strategy",
]


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
        """Describe `keypoints` (K, 3) of the scan; those that cannot be described are left out.

        The rest keeps its order. The number of scales L and of descriptors' entries D must not
        depend on the scan. Called from several threads.
        """


class Seed(Protocol):
    """Proposes matches by descriptor alone."""

    def __call__(self, source: View, target: View) -> Matches:
        """Return seed matches, by ascending distance; may be empty."""


class Propagate(Protocol):
    """Turns seed matches into hypotheses for the pose."""

    def __call__(
        self, source: View, target: View, seeds: Matches, rng: np.random.Generator
    ) -> Candidates:
        """Return candidate poses ``T_target_source`` (C, 4, 4), by ascending score; may be empty.

        `seeds` may be empty, or have been made by any other stage.
        """


class Refine(Protocol):
    """Makes a coarse pose accurate."""

    def __call__(self, source: View, target: View, T_init: Array) -> Registration:
        """Return the pose near `T_init` (4, 4) that fits the source to the target best.

        It rests on one pair at least; the order of `pairs` is free. `Pipeline.register` calls it
        from several threads, first on few points of the source, and compares the objectives.
        """


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
        what was refused, nor what was withdrawn. Where it already leads from source to target,
        the registration closes a loop, see `ViewGraph.loop`.
        """


@runtime_checkable
class JointJudge(Judge, Protocol):
    """A judge that can pool the evidence of several view pairs, as ``judge=evidence`` does."""

    def together(self, pairs: Sequence[ViewPair]) -> Evidence:
        """Pool what `pairs` show: how probable it is that all of them are right, and why not."""


@runtime_checkable
class ScreeningJudge(Judge, Protocol):
    """A judge that can reject a pose early: seen on few points, before it is refined on all."""

    def rejected_early(
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
    """The stages that a strategy and an adjustment work with; `mvreg.Pipeline` is the one there is.

    Its methods call the stages and tell the observers: who calls a stage by itself tells no one.
    """

    @property
    def downsample(self) -> Downsample:
        """Thins the scans out."""

    @property
    def describe(self) -> Describe:
        """Describes their keypoints."""

    @property
    def seed(self) -> Seed:
        """Proposes matches."""

    @property
    def propagate(self) -> Propagate:
        """Makes candidate poses of them."""

    @property
    def refine(self) -> Refine:
        """Makes a pose accurate."""

    @property
    def judge(self) -> Judge:
        """Says whether it can be relied on."""

    @property
    def augment(self) -> Augment:
        """Merges a view into the model."""

    @property
    def emit(self) -> Emit:
        """Tells observers of an event."""

    def observed_by(self, emit: Emit) -> Pipeline:
        """The same stages, reporting events to `emit`."""

    def with_stages(self, **stages: Any) -> Pipeline:
        """The pipeline with other stages, by kind: ``with_stages(judge=...)``.

        Raises InputError for a name that is no kind of stage in a pipeline.
        """

    def with_parameters(self, changes: Mapping[str, Any]) -> Pipeline:
        """The pipeline with stages' parameters replaced by dotted names, ``judge.min_overlap``.

        Raises InputError for what is no parameter of any registered stage.
        """

    def prepare(self, scans: Sequence[Scan], rng: np.random.Generator) -> list[View]:
        """Return a view per scan, in the order of `scans`; emits a `ViewPrepared` for each.

        Raises InputError for fewer than two scans, or two of one name.
        """

    def register(
        self,
        source: View,
        target: View,
        graph: ViewGraph,
        rng: np.random.Generator,
        checks: Sequence[Callable[[Registration, Verdict], Verdict]] = (),
        early_rejection: float = np.inf,
    ) -> tuple[Registration | None, Pair]:
        """Register a view to another or to a model; emits `PairStarted`, then `PairRegistered`.

        The registration is None if there was no candidate; the verdict is in the pair. `checks`
        have the last word, in turn.
        """

    def begin(self, reference: View) -> Model:
        """Begin a model with a view, whose frame is the model's; emits `ReferenceChosen`."""

    def extend(self, model: Model, source: View, registration: Registration) -> Model:
        """Merge a view into the model; emits `ViewPlaced` with the model."""

    def revise(self, result: Result) -> None:
        """Emit `PosesRevised`: all the poses at once, instead of those told before."""

    def place(self, view: View, T_model_scan: Array) -> None:
        """Emit `ViewPlaced` without a model, for a pose (4, 4) that needs no merging."""


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
