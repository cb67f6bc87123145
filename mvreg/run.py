"""Run a method on scans, as a library call."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
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
from mvreg.plugins import manager
from mvreg.stage_calls import checked
from mvreg.store.folder import Store, open_store
from mvreg.types import Result, Scan, Scans, ScanSet, View
from mvreg.types.given import as_scans

if TYPE_CHECKING:
    from omegaconf import DictConfig

#: Gigabytes that the store of a library call may take; on the command line ``store_size`` says so.
STORE_SIZE = 5.0


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


def dataset(name: str, rng: int = 0, **parameters: object) -> ScanSet:
    """Load a data set: ``dataset("bunny")``, ``dataset("folder", path="scans")``.

    Parameters
    ----------
    name : str
        A registered data set or a preset; ``python -m mvreg plugins dataset`` lists them.
    rng : int
        For an order or motions drawn at random.
    **parameters
        The data set's own, such as ``order="shuffle"``.

    Raises
    ------
    InputError
        If there is no such data set or parameter, or the scans cannot be read.
    """
    from mvreg.config.compose import compose

    changes = {f"dataset.{key}": value for key, value in parameters.items()}
    config = compose([f"dataset={spelled(name)}", *overrides_from(changes)])
    return load_scans(config, rng)


def load_scans(config: DictConfig, rng: int) -> ScanSet:
    """The scans that a composed configuration names, as `dataset` loads them."""
    from mvreg.config.compose import stage_from

    load = checked("dataset", stage_from(config, "dataset"))
    found: ScanSet = load(np.random.default_rng(rng))
    return found


def register(
    scans: Scans,
    method: str | Method = "auto",
    rng: int = 0,
    changes: Mapping[str, object] | None = None,
    observers: Sequence[object] = (),
    store: bool | str | Path = False,
    executor: Executor = THREADS,
) -> Result:
    """Find the poses of unordered scans.

    Parameters
    ----------
    scans : ScanSet, sequence, or mapping of names
        Each a `Scan`, an array (N, 3), or what looks like points, see `mvreg.types.PointLike`. At
        least two, in any order, each in a frame of its own, all in the same unit of length.
    method : str or Method
        A method's name ("fcpma"), or one put together by hand.
    rng : int
        Everything random follows from it.
    changes : mapping, optional
        Other stages or parameters: ``{"refine": "icp", "seed.top_fraction": 0.5}``.
    observers : sequence of objects
        With a hook ``mvreg_event(event)``, told what happens.
    store : bool or path
        Where finished work is kept, and found instead of done again: a folder, or True for that of
        the command line, see `mvreg.store`.
    executor : Executor
        Who works: `mvreg.execution.Threads`, `Dask` or `Shards`; the last two need a `store`.

    Returns
    -------
    Result
        `poses` maps names to ``T_model_scan`` (4, 4) in the unit of the scans, the identity for
        `reference`; `unregistered` names the scans that could not be placed. They are not in
        `poses`. `views` are the scans as the method prepared them, for `mvreg.assess`.

    Raises
    ------
    InputError
        For fewer than two scans, arrays that are not (N, 3) or not finite, an unknown method,
        stage or parameter.
    StageError
        If a stage raises an error, or returns what its contract does not allow; names the stage
        and the distribution that it came with.
    """
    method, generator = _method(method, changes), _generator(rng)
    with manager.observing(*observers):
        result, views, _ = run(
            as_scans(scans), method, generator, manager.emit, open_store(store, STORE_SIZE),
            executor,
        )  # fmt: skip
    return replace(result, views=tuple(views))


def prepare(
    scans: Scans,
    method: str | Method = "auto",
    rng: int = 0,
    changes: Mapping[str, object] | None = None,
) -> list[View]:
    """Down-sample and describe scans as a method does before it registers them.

    Parameters
    ----------
    scans, method, rng, changes
        As in `register`, which given the same makes the same views.

    Returns
    -------
    list of View
        In the order of the scans.

    Raises
    ------
    InputError
        As `register` does.
    """
    method, generator = _method(method, changes), _generator(rng)
    return method.pipeline.prepare(as_scans(scans), generator)


def _generator(rng: int) -> np.random.Generator:
    if rng < 0:
        raise InputError(f"rng: expected a whole number, 0 or more, got {rng}")
    return np.random.default_rng(rng)


def _method(method: str | Method, changes: Mapping[str, object] | None) -> Method:
    if isinstance(method, str):
        return load_method(method, changes)
    if changes:
        raise InputError("changes go with a method's name; this method is put together already")
    return method
