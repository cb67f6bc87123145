"""Several runs of the same command, each working on a share, that meet in the store.

For clusters that start many jobs, as Slurm's arrays do, and know nothing of each other. Every run
goes through the same rounds, works on its own share of the attempts of each, takes the others'
answers out of the store, and comes to the same result.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

from mvreg.contracts import Pipeline, Task
from mvreg.errors import InputError
from mvreg.execution.threads import Threads, Workers
from mvreg.execution.work import answer, key_of
from mvreg.store.folder import FolderStore, Store
from mvreg.types import View

#: How often a run looks whether another has finished what it waits for (seconds).
LOOK = 0.05


@dataclass(frozen=True)
class Shards:
    """Works on one share of each round; other runs of the same command work on the others.

    Parameters
    ----------
    part : str
        ``i/n``: the share of this run, from 1 to n.
    patience : float
        Seconds without a new answer after which a run does the others' work, too: one of them may
        be gone, or not yet there.
    """

    part: str = "1/1"
    patience: float = 30.0

    def __post_init__(self) -> None:
        index, count = self.share
        if not 1 <= index <= count:
            raise InputError(f"shard={self.part}: expected i/n with 1 <= i <= n, such as shard=2/8")
        if not self.patience > 0:
            raise InputError(f"executor.patience: expected seconds above 0, got {self.patience}")

    @property
    def share(self) -> tuple[int, int]:
        """The number of this run, from 1, and of all."""
        found = re.fullmatch(r"(\d+)/(\d+)", self.part.strip())
        return (int(found[1]), int(found[2])) if found else (0, 0)

    def session(self, store: Store) -> AbstractContextManager[Workers]:
        """The threads of this process, and the store that the runs share."""
        if not isinstance(store, FolderStore):
            raise InputError(
                f"shard={self.part}: expected a store that all runs share, got store=false; name a "
                "folder on a disk that all of them see: store=DIR"
            )
        return nullcontext(self)

    def __call__(
        self, tasks: Sequence[Task], views: Sequence[View], pipeline: Pipeline, store: Store
    ) -> Iterator[Any]:
        index, count = self.share
        own = [task for k, task in enumerate(tasks) if k % count == index - 1]
        answers = dict(zip(map(id, own), Threads()(own, views, pipeline, store), strict=True))
        limit = time.monotonic() + self.patience
        for task in tasks:
            if id(task) in answers:
                yield answers[id(task)]
                continue
            members = [views[k] for k in task.members]
            key = key_of(task, members, pipeline)
            if key is not None and waited_for(key, store, limit):
                limit = time.monotonic() + self.patience
            yield answer(task, members, pipeline, store, key)


def waited_for(key: str, store: Store, limit: float) -> bool:
    """Wait until the store has an answer, or the limit (s): another run may never give it."""
    assert isinstance(store, FolderStore)
    while not store.has(key):
        if time.monotonic() >= limit:
            return False
        time.sleep(LOOK)
    return True
