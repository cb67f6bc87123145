"""The stages put together: prepare scans, register a pair (Algorithm 1), grow a model."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from mvreg import contracts, events, plugins
from mvreg.errors import InputError
from mvreg.nearest import mean_spacing
from mvreg.normals import facing_normals
from mvreg.parallel import in_threads, one_by_one
from mvreg.types import (
    Array,
    Candidates,
    Model,
    Pair,
    Registration,
    Result,
    Sample,
    Scale,
    Scan,
    Verdict,
    View,
)

#: Candidates are compared, and brought near their optimum, on every n-th registration point: first
#: all of them on a few, then on more the best, if they are no worse than so many times the first.
SCREENING, FEWER, SHORTLIST, HOPELESS = 8, 32, 3, 4.0


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add the time spent inside to ``seconds[stage]``."""
    start = time.perf_counter()
    try:
        yield
    finally:
        seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Pipeline:
    """The stages that a strategy works with; `emit` is told what happens."""

    downsample: contracts.Downsample
    describe: contracts.Describe
    seed: contracts.Seed
    propagate: contracts.Propagate
    refine: contracts.Refine
    judge: contracts.Judge
    augment: contracts.Augment
    emit: events.Emit = events.ignore

    def observed_by(self, emit: events.Emit) -> Pipeline:
        """The pipeline, telling `emit` what happens."""
        return replace(self, emit=emit)

    def with_parameters(self, changes: Mapping[str, Any]) -> Pipeline:
        """The pipeline with some stages' parameters replaced, by dotted names.

        A stage that lacks a parameter which another registered stage of its kind has stays as it
        is: what suits one judge must not shut out another.

        Raises
        ------
        InputError
            For a name that is not ``kind.parameter`` of any stage.
        """
        changed = self
        for name, value in changes.items():
            kind, _, parameter = name.partition(".")
            stage = getattr(changed, kind) if kind in STAGES else None
            if stage is not None and parameter in parameters_of(stage):
                changed = replace(changed, **{kind: replace(stage, **{parameter: value})})
                continue
            registered = [s.cls for s in plugins.stages().values() if s.kind == kind]
            if stage is None or not any(parameter in parameters_of(cls) for cls in registered):
                options = parameters_of(stage) if stage is not None else STAGES
                raise InputError(
                    f"cannot change {name!r}: expected kind.parameter; options: "
                    f"{', '.join(options)}"
                )
        return changed

    def prepare(self, scans: Sequence[Scan], rng: np.random.Generator) -> list[View]:
        """Down-sample and describe every scan.

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
        with timed(seconds, "downsample"):
            samples, spacing = self.downsample(scans, rng)
        resolutions = in_threads(lambda sample: mean_spacing(sample.points), samples)
        scale = Scale(spacing, float(np.median([r for r in resolutions if r > 0] or [0.0])))

        def described(scan: Scan, sample: Sample, resolution: float) -> tuple[View, float]:
            begun = time.perf_counter()
            features = self.describe(scan, sample.keypoints, spacing)
            normals = facing_normals(scan, sample.points, features)
            view = View(scan.name, sample.points, normals, features, resolution, scale, scan)
            return view, time.perf_counter() - begun

        views = []
        each = list(zip(scans, samples, resolutions, strict=True))
        for index, (view, describing) in enumerate(one_by_one(lambda one: described(*one), each)):
            seconds["describe"] = describing
            self.emit(events.ViewPrepared(view, index, len(scans), seconds))
            views.append(view)
            seconds = {}
        return views

    def register(
        self,
        source: View,
        target: View,
        accepted: Sequence[Registration],
        rng: np.random.Generator,
        checks: Sequence[Callable[[Registration, Verdict], Verdict]] = (),
    ) -> tuple[Registration | None, Pair]:
        """Register one view to another, or to the model (Algorithm 1).

        `checks` have the last word, in turn: a strategy may know of what the judge is not shown.

        Returns
        -------
        registration : Registration or None
            The best of the refined candidates; None if there was no candidate.
        pair : Pair
            What is to be remembered of it, the verdict included.
        """
        self.emit(events.PairStarted(source, target))
        seconds: dict[str, float] = {}
        with timed(seconds, "seed"):
            seeds = self.seed(source, target)
        with timed(seconds, "propagate"):
            candidates = self.propagate(source, target, seeds, rng)
        with timed(seconds, "refine"):
            registration = self.refine_best(source, target, candidates)
        if registration is None:
            verdict = Verdict(False, float("inf"), 0.0, "no candidate pose")
            pair = Pair(source.name, target.name, verdict, seconds=seconds)
        else:
            with timed(seconds, "judge"):
                verdict = self.judge(registration, source, target, accepted)
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

    def refine_best(
        self, source: View, target: View, candidates: Candidates
    ) -> Registration | None:
        """Refine every candidate on a few points, and the best of them on all; None for none."""
        if not len(candidates):
            return None
        _ = target.tree  # built once, before the threads ask for it
        first = self.screen(source, target, candidates.poses, FEWER)
        limit = HOPELESS * first[0].objective
        left = [one.T_target_source for one in first[:SHORTLIST] if one.objective <= limit]
        best, *others = self.screen(source, target, left, SCREENING)
        registration = self.refine(source, target, best.T_target_source)
        others += first[len(left) :]
        rivals = np.array([other.T_target_source for other in others]).reshape(-1, 4, 4)
        return replace(registration, rivals=rivals)

    def screen(
        self, source: View, target: View, poses: Iterable[Array], step: int
    ) -> list[Registration]:
        """Refine poses on every `step`-th point of the source: the best first."""
        few = replace(source, points=source.points[::step], normals=source.normals[::step])
        found = in_threads(lambda pose: self.refine(few, target, pose), list(poses))
        return sorted(found, key=lambda registration: registration.objective)

    def begin(self, reference: View) -> Model:
        """Begin a model with a view, whose frame is the model's."""
        model = Model.of(reference)
        self.emit(events.ReferenceChosen(model))
        return model

    def extend(self, model: Model, source: View, registration: Registration) -> Model:
        """Merge a view into the model."""
        seconds: dict[str, float] = {}
        with timed(seconds, "augment"):
            model = self.augment(model, source, registration)
        pose: Array = registration.T_target_source
        self.emit(events.ViewPlaced(source.name, pose, model, seconds["augment"]))
        return model

    def revise(self, result: Result) -> None:
        """Tell observers of all the poses at once, instead of those told before."""
        self.emit(events.PosesRevised(result.reference, result.poses, result.components))

    def place(self, view: View, T_model_scan: Array) -> None:
        """Tell observers of a pose that needs no merging, as in a tree of scans."""
        self.emit(events.ViewPlaced(view.name, T_model_scan))


#: The kinds of stage in a pipeline.
STAGES = [field.name for field in fields(Pipeline) if field.name != "emit"]


def parameters_of(stage: Any) -> list[str]:
    """The names of the parameters of a stage or of its class."""
    return [field.name for field in fields(stage)]
