"""The stages put together: prepare scans, register a pair (Algorithm 1), extend a model."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from mvreg import contracts, events
from mvreg.errors import InputError
from mvreg.execution.threads import Threads, Workers
from mvreg.execution.work import found_or_made
from mvreg.geometry.nearest import mean_spacing
from mvreg.initial import with_initial
from mvreg.parallel import in_threads, one_by_one
from mvreg.screening import refine_best
from mvreg.stage_calls import check_described, checked
from mvreg.store.content import UnknownContentError, digest, stage_digest, versions
from mvreg.store.folder import NoStore, Store
from mvreg.surface.largest_range import without_largest_range
from mvreg.surface.normals import facing_normals
from mvreg.types import (
    Array,
    Model,
    Pair,
    Registration,
    Result,
    Sample,
    Scale,
    Scan,
    Verdict,
    View,
    ViewGraph,
)
from mvreg.types.lazy import forget
from mvreg.types.scan import too_many_trees


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add the time spent inside to ``seconds[stage]``."""
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start


NOTHING_KEPT, THREADS = NoStore(), Threads()


@dataclass(frozen=True)
class Pipeline:
    """The stages that a strategy works with.

    `emit` receives the events, `store` keeps finished work, `executor` are the workers for tasks.
    """

    downsample: contracts.Downsample
    describe: contracts.Describe
    seed: contracts.Seed
    propagate: contracts.Propagate
    refine: contracts.Refine
    judge: contracts.Judge
    augment: contracts.Augment
    emit: events.Emit = events.ignore
    store: Store = NOTHING_KEPT
    executor: Workers = THREADS

    def observed_by(self, emit: events.Emit) -> Pipeline:
        """The pipeline with `emit` as the receiver of its events."""
        return replace(self, emit=emit)

    def without_surroundings(self) -> Pipeline:
        """The same stages, telling nobody and keeping nothing: for another process."""
        return replace(self, emit=events.ignore, store=NOTHING_KEPT, executor=THREADS)

    def checked(self) -> Pipeline:
        """The pipeline with stages whose calls are checked, whoever calls them."""
        return replace(self, **{kind: checked(kind, getattr(self, kind)) for kind in STAGES})

    def with_stages(self, **stages: Any) -> Pipeline:
        """The pipeline with other stages, by kind: ``with_stages(judge=TmseJudge())``.

        Raises
        ------
        InputError
            For a name that is no kind of stage in a pipeline.
        """
        unknown = sorted(set(stages) - set(STAGES))
        if unknown:
            raise InputError(
                f"cannot exchange {', '.join(unknown)}: expected kinds of stage; options: "
                f"{', '.join(STAGES)}"
            )
        return replace(self, **stages)

    def with_parameters(self, changes: Mapping[str, Any]) -> Pipeline:
        """The pipeline with some stages' parameters replaced, by dotted names.

        Raises
        ------
        InputError
            For a name that is not ``kind.parameter`` of one of the stages; lists the options.
        """
        changed = self
        for name, value in changes.items():
            kind, _, parameter = name.partition(".")
            stage = getattr(changed, kind) if kind in STAGES else None
            options = STAGES if stage is None else [field.name for field in fields(stage)]
            if stage is None or parameter not in options:
                raise InputError(
                    f"cannot change {name!r}: expected kind.parameter; options: "
                    f"{', '.join(options)}"
                )
            changed = replace(changed, **{kind: replace(stage, **{parameter: value})})
        return changed

    def prepare(self, scans: Sequence[Scan], rng: np.random.Generator) -> list[View]:
        """Down-sample and describe every scan, without what stands at the largest range.

        Such points are no returns, see `mvreg.surface.largest_range`; the scan of a view, which
        answers for what its sensor saw, is without them, too.

        Raises
        ------
        InputError
            If there are fewer than two scans, or two share a name.
        """
        names = [scan.name for scan in scans]
        twice = sorted({name for name in names if names.count(name) > 1})
        if len(scans) < 2 or twice:
            found = f"{len(scans)} scan(s)" if len(scans) < 2 else f"{', '.join(twice)} twice"
            raise InputError(f"expected at least two scans with different names, got {found}")
        seconds: dict[str, float] = {}
        scans = in_threads(_looked_at, scans)
        with timed(seconds, "downsample"):
            samples, spacing = checked("downsample", self.downsample)(scans, rng)
        resolutions = in_threads(lambda sample: mean_spacing(sample.points), samples)
        describe = checked("describe", self.describe)
        many = too_many_trees(scans)
        scale = Scale(spacing, float(np.median([r for r in resolutions if r > 0] or [0.0])))

        def described(scan: Scan, sample: Sample, resolution: float) -> View:
            features, normals = found_or_made(
                self.store,
                lambda: described_key(describe, scan, sample, scale),
                lambda: described_anew(scan, sample, resolution),
            )
            if many:
                forget(scan, "tree")
            return View(scan.name, sample.points, normals, features, resolution, scale, scan)

        def described_anew(scan: Scan, sample: Sample, resolution: float) -> tuple[Any, ...]:
            features = describe(scan, sample.keypoints, spacing)
            return features, facing_normals(scan, sample.points, features, resolution)

        views = []
        each = list(zip(scans, samples, resolutions, strict=True))
        before = time.perf_counter()
        for index, view in enumerate(one_by_one(lambda one: described(*one), each)):
            seconds["describe"] = time.perf_counter() - before  # others are under way meanwhile
            self.emit(events.ViewPrepared(view, index, len(scans), seconds))
            views.append(view)
            seconds, before = {}, time.perf_counter()
        check_described(self.describe, views)
        return views

    def register(
        self,
        source: View,
        target: View,
        graph: ViewGraph,
        rng: np.random.Generator,
        checks: Sequence[Callable[[Registration, Verdict], Verdict]] = (),
        early_rejection: float = np.inf,
    ) -> tuple[Registration | None, Pair]:
        """Register one view to another, or to the model (Algorithm 1).

        `checks` may overrule the verdict, in turn: a strategy may know what the judge is not shown.
        A pose that the judge, shown few of the points, scores worse than `early_rejection` times
        its threshold is not refined on all of them, see `contracts.ScreeningJudge`.

        Returns
        -------
        registration : Registration or None
            The best of the refined candidates; None if there was no candidate.
        pair : Pair
            What is to be remembered of it, the verdict included.
        """

        def rejected_early(registration: Registration, subsampled: View) -> bool:
            if early_rejection == np.inf or not isinstance(judge, contracts.ScreeningJudge):
                return False
            return judge.rejected_early(registration, subsampled, target, graph, early_rejection)

        refine, judge = checked("refine", self.refine), checked("judge", self.judge)
        self.emit(events.PairStarted(source, target))
        seconds: dict[str, float] = {}
        with timed(seconds, "seed"):
            seeds = checked("seed", self.seed)(source, target)
        with timed(seconds, "propagate"):
            candidates = checked("propagate", self.propagate)(source, target, seeds, rng)
            candidates = with_initial(candidates, source, target)
        with timed(seconds, "refine"):
            registration = refine_best(refine, source, target, candidates, rejected_early)
        if registration is None:
            verdict = Verdict(False, float("inf"), 0.0, "no candidate pose")
            pair = Pair(source.name, target.name, verdict, seconds=seconds)
        else:
            with timed(seconds, "judge"):
                verdict = judge(registration, source, target, graph)
                for check in checks:
                    verdict = check(registration, verdict)
            pair = Pair(
                source.name,
                target.name,
                verdict,
                registration.T_target_source,
                registration.overlap,
                registration.trimmed_mse,
                seconds,
            )
        self.emit(events.PairRegistered(source, target, seeds, candidates, registration, pair))
        return registration, pair

    def perform(self, tasks: Sequence[contracts.Task], views: Sequence[View]) -> Iterator[Any]:
        """Work on tasks side by side: their answers, in their order, each as soon as it is there.

        See `mvreg.contracts.Pipeline.perform`.
        """
        return self.executor(tasks, views, self.observed_by(events.ignore), self.store)

    def begin(self, reference: View) -> Model:
        """Begin a model with a view, whose frame is the model's."""
        model = Model.of(reference)
        self.emit(events.ReferenceChosen(model))
        return model

    def extend(self, model: Model, source: View, registration: Registration) -> Model:
        """Merge a view into the model."""
        seconds: dict[str, float] = {}
        with timed(seconds, "augment"):
            model = checked("augment", self.augment)(model, source, registration)
        pose: Array = registration.T_target_source
        self.emit(events.ViewPlaced(source.name, pose, model, seconds["augment"]))
        return model

    def revise(self, result: Result) -> None:
        """Tell observers of all the poses at once, instead of those told before."""
        self.emit(events.PosesRevised(result.reference, result.poses, result.components))

    def place(self, view: View, T_model_scan: Array) -> None:
        """Tell observers of a pose that needs no merging, as in a tree of scans."""
        self.emit(events.ViewPlaced(view.name, T_model_scan))


def _looked_at(scan: Scan) -> Scan:
    """The scan without what stands at the largest range, its spacing known: by one tree."""
    found = without_largest_range(scan)
    _ = found.spacing
    return found


def described_key(
    describe: contracts.Describe, scan: Scan, sample: Sample, scale: Scale
) -> str | None:
    """What the description of a scan is kept under."""
    try:
        return digest(versions(), "described", stage_digest(describe), scan, sample, scale)
    except UnknownContentError:
        return None


#: The kinds of stage in a pipeline.
STAGES = [
    field.name for field in fields(Pipeline) if field.name not in ("emit", "store", "executor")
]
