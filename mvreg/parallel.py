"""Independent work on all cores; the results come in order and do not depend on their number."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from threading import local
from typing import Generic, TypeVar

Item = TypeVar("Item")
Answer = TypeVar("Answer")

#: Seconds that a thread waits for the interpreter before it asks another for it. Python's 5 ms are
#: as long as several kernels; with this the Bunny takes 5 to 10 per cent less, 1 ms helps less.
TURN = 2e-4

#: Known to each thread by itself: whether it is one of those that work here.
INSIDE = local()


def threads() -> int:
    """How many threads to use: what OMP_NUM_THREADS says, else one for each core.

    NumPy goes by that variable too, and Open3D is told to (`mvreg.load_open3d`); joblib, Hydra's
    launcher for parallel jobs, sets it in its processes, so that jobs side by side share the cores.
    """
    wanted = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0].strip()
    return int(wanted) if wanted.isdecimal() and int(wanted) > 0 else _cores()


def spare() -> bool:
    """Whether a core has nothing to do while this thread works."""
    return threads() > 1 and not _busy()


def quick_turns() -> None:
    """Let the threads of this process take turns at the interpreter more often.

    For a process of one's own, such as that of the command line: it holds for all its threads.
    """
    sys.setswitchinterval(TURN)


def in_threads(function: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
    """``[function(item) for item in items]``, in threads: NumPy and the kernels release the lock.

    `function` must not share anything that it changes, a random generator least of all. Called
    within itself it works through its items in one thread: the cores are busy already. The caller's
    thread works, too: it need not wait until another has woken up.
    """
    helpers = min(threads(), len(items)) - 1
    if helpers < 1 or _busy():
        return [function(item) for item in items]
    work = _Work(function, items)
    asked = [_pool(threads()).submit(work.go_on) for _ in range(helpers)]
    INSIDE.busy = True
    try:
        work.go_on()
    finally:
        INSIDE.busy = False
        work.left.clear()
        for helper in asked:
            if not helper.cancel():  # it has begun
                helper.result()
    return work.done()


def one_by_one(function: Callable[[Item], Answer], items: Sequence[Item]) -> Iterator[Answer]:
    """The same answers, each as soon as it and those before it are there."""
    workers = threads()
    if min(workers, len(items)) < 2 or _busy():
        return map(function, items)
    return _pool(workers).map(function, items)


class _Work(Generic[Item, Answer]):
    """Items that threads take one after the other, and the answers in their order."""

    def __init__(self, function: Callable[[Item], Answer], items: Sequence[Item]) -> None:
        self.function, self.items = function, items
        self.left = deque(range(len(items)))
        self.answers: dict[int, Answer] = {}
        self.errors: dict[int, Exception] = {}

    def go_on(self) -> None:
        """Work as long as there is something left."""
        while self.left:
            try:
                place = self.left.popleft()
            except IndexError:  # another thread was faster
                return
            try:
                self.answers[place] = self.function(self.items[place])
            except Exception as error:
                self.errors[place] = error
                self.left.clear()

    def done(self) -> list[Answer]:
        """The answers, or the first of what went wrong."""
        if self.errors:
            raise self.errors[min(self.errors)]
        return [self.answers[place] for place in range(len(self.items))]


def slices(size: int, least: int) -> list[slice]:
    """``range(size)`` cut into parts of `least` or more, a few for each thread."""
    count = max(1, min(size // least, 4 * threads()))
    ends = [size * part // count for part in range(count + 1)]
    return [slice(*pair) for pair in pairwise(ends)]


def in_parts(function: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
    """As `in_threads`, many items at a time: one takes hardly longer than handing it over does."""
    parts = slices(len(items), 1)
    done = in_threads(lambda part: [function(item) for item in items[part]], parts)
    return [answer for part in done for answer in part]


@cache
def _cores() -> int:
    return os.cpu_count() or 1  # the system reads a file for it


def _busy() -> bool:
    return getattr(INSIDE, "busy", False)


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    """Threads are started once: to start them takes as long as many a kernel."""
    return ThreadPoolExecutor(workers, "mvreg", _begin)


def _begin() -> None:
    INSIDE.busy = True


# The threads of a process do not live on in its fork.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)
