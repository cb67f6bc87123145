"""The clock of a simulated cluster: one client, one scheduler, and workers that take tiles."""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from experiments.bench.trace import Round
from mvreg.execution.dask import cuts

#: Seconds that the scheduler takes for each tile.
SCHEDULER = 1e-3
#: What the client waits for, beside its own parts.
WORKERS, ALONE = "attempts in workers", "single attempts"


@dataclass
class Cluster:
    """Works through rounds as `mvreg.execution.dask` does, and notes what the client was at.

    Parameters
    ----------
    workers : int
    scans : int
    read : float
        Seconds for a worker to read a view for the first time.
    scheduler : float
        Seconds for each tile, one after another.
    clock : float
        Seconds since the beginning.
    path : dict of str to float
        The critical path: how long the client was at each part, or waited for the workers. The
        client is never idle otherwise, so that the sum is `clock`.
    worked : float
        Seconds that the workers worked, in all.
    rounds : list of (int, float, float)
        Of each round its attempts, how long it took, and how long these took by themselves.
    """

    workers: int
    scans: int
    read: float
    scheduler: float = SCHEDULER
    clock: float = 0.0
    path: dict[str, float] = field(default_factory=dict)
    worked: float = 0.0
    rounds: list[tuple[int, float, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.views = [0.0] * self.workers  # that each has read, as is to be expected

    def spend(self, part: str, seconds: float) -> None:
        """Let the client work."""
        self.clock += seconds
        self.path[part] = self.path.get(part, 0.0) + seconds

    def wait(self, until: float) -> None:
        """Let the client wait for the workers."""
        self.spend(WORKERS, max(0.0, until - self.clock))

    def round(self, one: Round) -> None:
        """One round of attempts; the client learns of each, in order, once its tile is there."""
        count, began, worked = len(one.tasks), self.clock, self.worked
        self.spend("choose", one.choose)
        self.spend("keys", one.keys)
        if count == 1:  # not worth sending
            self.spend(ALONE, one.tasks[0][0])
            worked -= one.tasks[0][0]
            ends = [self.clock]
        else:
            ends = self.tiles(one.tasks)
        for end in ends:
            self.wait(end)
            self.spend("answers", one.answers / count)
            self.spend("learn", one.learn / count)
        self.rounds.append((count, self.clock - began, self.worked - worked))

    def tiles(self, tasks: Sequence[tuple[float, int]]) -> list[float]:
        """When each task's tile is done; a tile goes to the first worker that is free."""
        free = [(self.clock, k) for k in range(self.workers)]
        ends: list[float] = []
        for number, (first, last) in enumerate(pairwise(cuts(len(tasks), self.workers)), start=1):
            at, worker = heapq.heappop(free)
            start = max(at, self.clock + number * self.scheduler)
            end = start + sum(self.took(worker, *task) for task in tasks[first:last])
            self.worked += end - start
            heapq.heappush(free, (end, worker))
            ends += [end] * (last - first)
        return ends

    def took(self, worker: int, seconds: float, members: int) -> float:
        """How long a task takes a worker, with the views that it has not yet read."""
        new = members * max(0.0, 1 - self.views[worker] / self.scans)
        self.views[worker] = min(float(self.scans), self.views[worker] + new)
        return seconds + new * self.read


def simulated(
    rounds: Sequence[Round],
    client: Mapping[str, float],
    workers: int,
    scans: int,
    read: float,
    scheduler: float = SCHEDULER,
    prepared: bool = False,
) -> Cluster:
    """A run from its beginning to its end.

    Parameters
    ----------
    rounds : sequence of Round
    client : mapping of str to float
        Seconds for `prepare`, `scores`, `withdraw` and `adjust`.
    workers, scans, read, scheduler
        See `Cluster`.
    prepared : bool
        As if workers prepared the scans.
    """
    cluster = Cluster(workers, scans, read, scheduler)
    if prepared:
        cluster.wait(max(cluster.tiles([(client["prepare"] / scans, 0)] * scans)))
    else:
        cluster.spend("prepare", client["prepare"])
    cluster.spend("scores", client["scores"])
    for one in rounds:
        cluster.round(one)
    for part in ("withdraw", "adjust"):
        cluster.spend(part, client[part])
    return cluster
