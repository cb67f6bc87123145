"""One job of the command line: run a configuration, and keep the result in a folder."""

from __future__ import annotations

import time
import warnings
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.config.compose import executor_from
from mvreg.events import AdjustStarted, Event, RunFinished, RunStarted
from mvreg.memory import give_back_arrays, give_back_holes
from mvreg.parallel import quick_turns
from mvreg.plugins import manager
from mvreg.run import load_scans, method_from, run
from mvreg.store.folder import open_store, remarks_on
from mvreg.types import Result

if TYPE_CHECKING:
    from omegaconf import DictConfig

    from mvreg.observers.rerun.observer import RerunObserver


def run_job(config: DictConfig, folder: Path) -> Result:
    """Run what a composed configuration asks for, and keep it in `folder`.

    Interrupted, it leaves what was finished: pairs, and a partial result.
    """
    from omegaconf import OmegaConf

    from mvreg.cli.export import FOLDER, tell
    from mvreg.cli.parts import doubts_on_parts
    from mvreg.export.run import export
    from mvreg.export.table import formats_of
    from mvreg.observers.console import Console
    from mvreg.observers.recorder import Recorder
    from mvreg.report.build import build_report
    from mvreg.report.json_file import load_report
    from mvreg.report.table import render

    quick_turns()
    give_back_arrays()
    plain: dict[str, Any] = OmegaConf.to_container(config, resolve=True, enum_to_str=True)  # type: ignore[assignment]
    method = method_from(config)
    formats = formats_of(config.export)
    store, executor = open_store(config.store, config.store_size), executor_from(config)
    start = time.perf_counter()
    scanset = load_scans(config, config.rng)
    loading = time.perf_counter() - start
    extra = recordings(folder) if config.rerun else []

    def make_room() -> bool:
        return any(observer.give_up() for observer in extra)

    recorder, console = Recorder(folder, page=config.report, make_room=make_room), Console()

    def emit(event: Event) -> None:
        recorder.mvreg_event(event)  # not as an observer, which may fail: this is the result
        manager.emit(event)
        if isinstance(event, RunStarted | AdjustStarted):
            give_back_holes()

    try:
        with manager.observing(console, *extra):
            emit(RunStarted(scanset, method.name, folder))
            rng = np.random.default_rng(config.rng)
            result, views, seconds = run(scanset.scans, method, rng, emit, store, executor)
            scanset = replace(scanset, remarks=(*scanset.remarks, *remarks_on(store)))
            seconds["load"] = loading
            if scanset.input is not None:
                doubts = doubts_on_parts(scanset, result, method, rng)
                found = replace(scanset.input, findings=(*scanset.input.findings, *doubts))
                scanset = replace(scanset, input=found)
            report = build_report(
                scanset, views, result, method=method.name, rng=config.rng, seconds=seconds,
                config=plain,
            )  # fmt: skip
            emit(RunFinished(scanset, result, report))
        if formats:
            tell(export(report, formats, folder / FOLDER, lambda: scanset, lambda _: views))
        return result
    except KeyboardInterrupt:
        finished = recorder.finish_interrupted(config.rng, plain)
        console.close()
        if finished is not None:
            render(load_report(finished), folder)
        raise
    finally:
        for close in (recorder.close, console.close, *(observer.close for observer in extra)):
            close()


def recordings(folder: Path) -> list[RerunObserver]:
    """What writes the recording; nothing, and a warning, where Rerun is not installed."""
    from mvreg.observers.rerun.observer import RerunObserver

    if find_spec("rerun") is None:
        warnings.warn(
            "no recording, since rerun-sdk is not installed (it has no current wheels for Macs "
            "with Intel processors): install it with pip install rerun-sdk, or leave the recording "
            "out with rerun=false",
            stacklevel=2,
        )
        return []
    return [RerunObserver(folder / "run.rrd")]
