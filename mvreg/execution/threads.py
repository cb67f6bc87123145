"""The threads of this process."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, Protocol

from mvreg.contracts import Pipeline, Task
from mvreg.execution.work import worked
from mvreg.parallel import one_by_one
from mvreg.store.folder import Store
from mvreg.types import View


class Workers(Protocol):
    """Work on tasks."""

    def __call__(
        self, tasks: Sequence[Task], views: Sequence[View], pipeline: Pipeline, store: Store
    ) -> Iterator[Any]:
        """The answers to tasks, in their order, each as soon as it is there.

        What the store has is not worked out again, and what is worked out is kept there.
        """


class Executor(Protocol):
    """Finds workers for a run; a frozen dataclass, its fields are its parameters."""

    def session(self, store: Store) -> AbstractContextManager[Workers]:
        """Workers for as long as a run lasts.

        Raises
        ------
        InputError
            If there are none; says why, and what to do.
        """


@dataclass(frozen=True)
class Threads:
    """Works in the threads of this process, one for each core (``OMP_NUM_THREADS``)."""

    def session(self, store: Store) -> AbstractContextManager[Workers]:
        """These threads."""
        return nullcontext(self)

    def __call__(
        self, tasks: Sequence[Task], views: Sequence[View], pipeline: Pipeline, store: Store
    ) -> Iterator[Any]:
        def work(task: Task) -> Any:
            return worked(task, [views[k] for k in task.members], pipeline, store)

        return one_by_one(work, tasks)
