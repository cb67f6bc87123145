"""Run a method on scans."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mvreg import contracts
from mvreg.config.overrides import overrides_from, spelled
from mvreg.errors import InputError
from mvreg.events import (
    AdjustStarted,
    Emit,
    Event,
    ViewPlaced,
    ViewPrepared,
)
from mvreg.execution.threads import Executor
from mvreg.initial import in_their_frame
from mvreg.pipeline import NOTHING_KEPT, THREADS, Pipeline
from mvreg.stage_calls import checked
from mvreg.store.folder import Store
from mvreg.types import Result, Scan, ScanSet, View

if TYPE_CHECKING:
    from omegaconf import DictConfig


@dataclass(frozen=True)
class Method:
    """A method under its name: the stages of a pair, the outer loop, and what follows it."""

    name: str
    pipeline: Pipeline
    strategy: contracts.Strategy
    adjust: contracts.Adjust


class Stopwatch:
    """Adds up the time per stage that the events report, and passes them on."""

    def __init__(self, emit: Emit) -> None:
        self.emit = emit
        self.seconds: dict[str, float] = {}

    def __call__(self, event: Event) -> None:
        match event:
            case ViewPrepared():
                for stage, seconds in event.seconds.items():
                    self.add(stage, seconds)
            case ViewPlaced():
                self.add("augment", event.seconds)
        self.emit(event)

    def add(self, stage: str, seconds: float) -> None:
        self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds


def run(
    scans: Sequence[Scan],
    method: Method,
    rng: np.random.Generator,
    emit: Emit,
    store: Store = NOTHING_KEPT,
    executor: Executor = THREADS,
) -> tuple[Result, list[View], dict[str, float]]:
    """Place the scans: prepare, grow, adjust; what the `store` has of it is not done again.

    The `executor` finds the workers.

    Returns
    -------
    result : Result
    views : list of View
        The prepared scans, in the order of `scans`.
    seconds : dict
        Time per stage, and in all.
    """
    check_fixed(scans, method)
    with executor.session(store) as workers:
        pipeline = replace(method.pipeline, store=store, executor=workers)
        return _placed(scans, replace(method, pipeline=pipeline), rng, emit)


def _placed(
    scans: Sequence[Scan], method: Method, rng: np.random.Generator, emit: Emit
) -> tuple[Result, list[View], dict[str, float]]:
    """What `run` answers, its workers being there."""
    start = time.perf_counter()
    watch = Stopwatch(emit)
    pipeline = method.pipeline.observed_by(watch).checked()
    views = pipeline.prepare(scans, rng)
    result = checked("strategy", method.strategy)(views, pipeline, rng)
    before = time.perf_counter()
    emit(AdjustStarted(result))
    result = checked("adjust", method.adjust)(result, views, pipeline)
    result = in_their_frame(result, scans)
    watch.add("adjust", time.perf_counter() - before)
    watch.add("total", time.perf_counter() - start)
    return result, views, watch.seconds


def check_fixed(scans: Sequence[Scan], method: Method) -> None:
    """Refuse several fixed scans for stages that would move them against each other.

    A stage that holds them says so by an attribute ``holds_fixed``.

    Raises
    ------
    InputError
        Names the stage.
    """
    if sum(scan.fixed for scan in scans) < 2:
        return
    for kind in ("strategy", "adjust"):
        stage = getattr(method, kind)
        if not getattr(stage, "holds_fixed", False):
            raise InputError(
                f"dataset.fixed: {type(stage).__name__} cannot hold several scans; fix one, or "
                f"use {'strategy=best_first' if kind == 'strategy' else 'adjust=joint'}"
            )


def load_method(name: str = "auto", changes: Mapping[str, object] | None = None) -> Method:
    """The stages of a named method, as the command line would compose them.

    Parameters
    ----------
    name : str
        A method's name, as in ``+method=fcpma``; "auto" is what runs without one.
    changes : mapping, optional
        Other stages or parameters: ``{"refine": "icp", "seed.top_fraction": 0.5}``.

    Raises
    ------
    InputError
        If there is no such method, stage or parameter; lists the options.
    """
    from mvreg.config.compose import compose

    chosen = [] if name == "auto" else [f"+method={spelled(name)}"]
    return method_from(compose([*chosen, *overrides_from(changes or {})]))


def method_from(config: DictConfig) -> Method:
    """The method that a composed configuration describes."""
    from mvreg.config.compose import stages_from

    stages = stages_from(config)
    strategy, adjust = stages.pop("strategy"), stages.pop("adjust")
    return Method(str(config.method), Pipeline(**stages), strategy, adjust)


def load_scans(config: DictConfig, rng: int) -> ScanSet:
    """The scans that a composed configuration names, as `dataset` loads them."""
    from mvreg.config.compose import stage_from

    load = checked("dataset", stage_from(config, "dataset"))
    found: ScanSet = load(np.random.default_rng(rng))
    return found
