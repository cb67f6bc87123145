"""Checks of what a plugin brings beside stages: observers and presets."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from mvreg.config.presets import addresses, choices
from mvreg.errors import MvregError
from mvreg.events import Event, RunFinished, RunStarted
from mvreg.kit.outcomes import Outcome, Subject
from mvreg.plugins.pluggy_manager import Manager
from mvreg.report.build import build_report
from mvreg.run import Method, method_from, run
from mvreg.stages import GrowStrategy, NoAdjust
from mvreg.testing import blob_scans, pipeline


def check_observer(alone: Manager, plugin: str, origin: str) -> Iterator[Outcome]:
    """Tell a plugin's observer the events of a small run; it may write into the run's folder."""
    subject = Subject("observer", plugin, origin)
    with tempfile.TemporaryDirectory(prefix="mvreg-check-") as folder:
        for hook in alone.hook.mvreg_event.get_hookimpls():

            def tell(hook: object = hook) -> None:
                for event in (RunStarted(blob_scans(3), "grow", Path(folder)), *events()):
                    hook.function(*[event for _ in hook.argnames])  # type: ignore[attr-defined]

            yield subject.asked("it takes the events of a run", tell)


@cache
def events() -> tuple[Event, ...]:
    """What happens when the three scans of `blob_scans` are registered, once it has started."""
    scans = blob_scans(3)
    found: list[Event] = []
    method = Method("grow", pipeline(), GrowStrategy(levels=[{}]), NoAdjust())
    result, views, seconds = run(scans.scans, method, np.random.default_rng(0), found.append)
    report = build_report(
        scans, views, result, method=method.name, rng=0, seconds=seconds, config={}
    )
    return (*found, RunFinished(scans, result, report))


def check_presets(alone: Manager, plugin: str, origin: str) -> Iterator[Outcome]:
    """Compose every method and data set that a plugin has a preset of."""
    from mvreg.config.compose import check, compose, stage_from

    for hook in alone.hook.mvreg_config_path.get_hookimpls():
        path = Subject("presets", plugin, origin)
        found: list[str] = []

        def look(hook: object = hook, found: list[str] = found) -> None:
            found.extend(addresses(hook.function(), f"plugin {plugin!r} ({origin})"))  # type: ignore[attr-defined]
            if not found:
                raise MvregError(
                    f"expected presets where mvreg_config_path() leads, such as method/mine.yaml; "
                    f"got no .yaml file in {hook.function()!r}"  # type: ignore[attr-defined]
                )

        yield path.asked("there are some", look)
        for address in found:
            group, _, name = address.rpartition("/")
            if group not in choices():
                continue
            plus = "+" if group in ("method", "experiment") else ""
            word = f"{plus}{group}={name}"

            def put_together(word: str = word) -> None:
                config = compose([word])
                check(config)
                method_from(config)
                stage_from(config, "dataset")

            yield Subject(word, plugin, origin).asked("it can be composed", put_together)
