"""The threads of this process."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from mvreg.contracts import Pipeline, Task
from mvreg.execution.work import worked
from mvreg.parallel import one_by_one
from mvreg.store.folder import Store
from mvreg.types import View


@dataclass(frozen=True)
class Threads:
    """Works in the threads of this process, one for each core (``OMP_NUM_THREADS``)."""

    def __call__(
        self, tasks: Sequence[Task], views: Sequence[View], pipeline: Pipeline, store: Store
    ) -> Iterator[Any]:
        def work(task: Task) -> Any:
            return worked(task, [views[k] for k in task.members], pipeline, store)

        return one_by_one(work, tasks)
