"""Independent work on all cores; the answers come in order and do not depend on how many."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Answer = TypeVar("Answer")


def in_threads(function: Callable[[Item], Answer], items: Sequence[Item]) -> list[Answer]:
    """``[function(item) for item in items]``, in threads: NumPy and SciPy release the lock.

    `function` must not share anything that it changes, a random generator least of all.
    """
    workers = min(os.cpu_count() or 1, len(items))
    if workers < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(function, items))
