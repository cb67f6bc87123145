"""What strategies and adjustments may ask of the pipeline."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from mvreg.contracts.kinds import (
    Augment,
    Describe,
    Downsample,
    Judge,
    Propagate,
    Refine,
    Seed,
)
from mvreg.events import Emit
from mvreg.types import Array, Model, Pair, Registration, Result, Scan, Verdict, View, ViewGraph


class Task(Protocol):
    """A piece of work that nothing else depends on, and that depends on nothing else.

    A frozen dataclass: its answer follows from its fields, the views and the stages alone. A field
    whose metadata say ``{"stored": False}`` does not count. Where the class names the ``kinds`` of
    stage that it uses, its answers are kept and found again; ``answers`` are the classes of the
    records in them that are not of `mvreg.types`.
    """

    @property
    def members(self) -> tuple[int, ...]:
        """The views that it needs, by their positions."""

    def __call__(self, views: Sequence[View], pipeline: Pipeline) -> Any:
        """Work it out; `views` are the members, in their order."""


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

    def without_surroundings(self) -> Pipeline:
        """The same stages, telling nobody and keeping nothing: for another process."""

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

    def perform(self, tasks: Sequence[Task], views: Sequence[View]) -> Iterator[Any]:
        """Work on tasks side by side: their answers, in their order, each as soon as it is there.

        A task names the views that it needs by their positions among `views`. The answers are the
        same however many work on them, and where.
        """

    def begin(self, reference: View) -> Model:
        """Begin a model with a view, whose frame is the model's; emits `ReferenceChosen`."""

    def extend(self, model: Model, source: View, registration: Registration) -> Model:
        """Merge a view into the model; emits `ViewPlaced` with the model."""

    def revise(self, result: Result) -> None:
        """Emit `PosesRevised`: all the poses at once, instead of those told before."""

    def place(self, view: View, T_model_scan: Array) -> None:
        """Emit `ViewPlaced` without a model, for a pose (4, 4) that needs no merging."""
