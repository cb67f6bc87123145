"""What a run of the default method costs, task by task, and between its tasks.

Everything is measured in CPU seconds of one thread, so that other programs do not count: each task
as a worker of a cluster would do it, and what the client does before, between and after them.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

from mvreg.contracts import Pipeline, Task
from mvreg.execution.work import key_of
from mvreg.report.run_folder import write_text
from mvreg.store.content import digest, versions
from mvreg.store.folder import FolderStore, Store
from mvreg.types import View

now = time.process_time


@dataclass
class Round:
    """One round of attempts; all times in seconds.

    Parameters
    ----------
    models : int
        Partial models that there were before.
    choose : float
        The client, before it: joins by agreement, and the choice of the attempts.
    keys : float
        The client's hashes of the tasks, and views written for the workers.
    answers : float
        The client's reading of the answers.
    learn : float
        The client's joins and the like.
    tasks : list of [float, int]
        Each attempt: how long it took, with its answer kept in the store, and its members.
    """

    models: int
    choose: float
    keys: float = 0.0
    answers: float = 0.0
    learn: float = 0.0
    tasks: list[tuple[float, int]] = field(default_factory=list)


@dataclass
class Trace:
    """One run, in seconds. `read` is of one view; the others are what the client did."""

    scans: int
    placed: int = 0
    prepare: float = 0.0
    scores: float = 0.0
    withdraw: float = 0.0
    adjust: float = 0.0
    read: float = 0.0
    rounds: list[Round] = field(default_factory=list)


@dataclass
class Traced:
    """An executor that does what Dask's client and its workers do, in turn, and notes it."""

    trace: Trace
    models: int = 0
    left: float = field(default_factory=now)
    written: dict[int, str] = field(default_factory=dict)

    def session(self, store: Store) -> AbstractContextManager[Traced]:
        """Itself."""
        self.left = now()
        return nullcontext(self)

    def since(self) -> float:
        """Seconds since the client was left to itself."""
        return now() - self.left

    def __call__(
        self, tasks: Sequence[Task], views: Sequence[View], pipeline: Pipeline, store: Store
    ) -> Iterator[Any]:
        kind = type(tasks[0]).__name__ if tasks else ""
        before = self.since()
        if kind != "Attempt":
            self.client(kind, before)
            for task in tasks:
                yield task([views[k] for k in task.members], pipeline)
            return
        assert isinstance(store, FolderStore)
        one = Round(self.models, before)
        self.trace.rounds.append(one)
        start = now()
        keys = [key_of(task, [views[k] for k in task.members], pipeline) for task in tasks]
        for k in sorted({k for task in tasks for k in task.members} - self.written.keys()):
            self.written[k] = digest(versions(), "view", views[k])
            store.keep(self.written[k], views[k])
        one.keys = now() - start
        stages = pipeline.without_surroundings()
        for task, key in zip(tasks, keys, strict=True):
            members = [views[k] for k in task.members]
            assert key is not None
            start = now()
            store.keep(key, task(members, stages))
            one.tasks.append((now() - start, len(members)))
            start = now()
            found = store.find(key, *getattr(task, "answers", ()))
            one.answers += now() - start
            self.left = now()
            yield found
            one.learn += self.since()
        self.left = now()

    def client(self, kind: str, before: float) -> None:
        """Note what came before a task that the client works on itself."""
        if kind == "Scores":
            self.trace.prepare += before
        else:
            self.trace.withdraw += before
        self.left = now()


def traced(scans: int) -> Trace:
    """Register so many scans of the column, on one thread."""
    import numpy as np

    from experiments.bench import many
    from mvreg.run import load_method, run
    from mvreg.stages.strategy.best_first import strategy
    from mvreg.stages.strategy.best_first.search import Search

    os.environ["OMP_NUM_THREADS"] = "1"
    scanset = many.scans("column", scans)
    trace = Trace(scans)
    executor = Traced(trace)

    class Counted(Search):
        """Tells the executor how many partial models there are."""

        def batch(self) -> list[tuple[int, list[int]]]:
            executor.models = sum(len(members) > 0 for members in self.models.groups())
            if not trace.rounds:
                trace.scores = executor.since()
                executor.left = now()
            return super().batch()

    with (
        tempfile.TemporaryDirectory(prefix="mvreg-trace-") as place,
        patch.object(strategy, "Search", Counted),
    ):
        store = FolderStore(Path(place), 50 * 10**9)
        result, _, _ = run(
            scanset.scans, load_method("auto"), np.random.default_rng(1), lambda event: None, store,
            executor,
        )  # fmt: skip
        trace.adjust = executor.since()
        trace.placed = len(result.poses)
        fresh = FolderStore(Path(place), 50 * 10**9)
        start = now()
        for key in executor.written.values():
            fresh.find(key)
        trace.read = (now() - start) / max(1, len(executor.written))
    return trace


def kept(scans: int, folder: Path) -> Trace:
    """The trace of a run, measured now or before by the same code."""
    file = folder / f"trace_{scans}_{versions()[:12]}.json"
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        write_text(file, json.dumps(asdict(traced(scans))))
    found = json.loads(file.read_text())
    found["rounds"] = [
        Round(**{**one, "tasks": [tuple(task) for task in one["tasks"]]}) for one in found["rounds"]
    ]
    return Trace(**found)
