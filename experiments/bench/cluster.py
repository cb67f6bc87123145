"""A cluster of 64 workers with 10,000 scans, simulated from runs of fewer that are measured here.

    python -m experiments.bench.cluster
    python -m experiments.bench.cluster --scans 2000 --workers 16 --from 20 60

Measured, in CPU seconds of one thread: every attempt of runs of the column, and what the client
does before, between and after them. The largest run gives the rounds, `replay.replayed`; all of
them how the client's work grows. Simulated: the rounds as Dask's client has them worked on, in its
tiles. Prints the critical path as Markdown. What was measured is kept in the folder, and not
measured again by the same code.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from experiments.bench.replay import client_seconds, growth, replayed, with_client
from experiments.bench.simulated import ALONE, SCHEDULER, WORKERS, Cluster, simulated
from experiments.bench.trace import Trace, kept
from mvreg.report.comparison.formats import markdown

#: In words.
PARTS = {
    "prepare": "scans prepared: points drawn, described",
    "scores": "overlap scores",
    "choose": "attempts chosen, pairs that agree joined",
    "keys": "attempts hashed, views written for the workers",
    WORKERS: "waiting for the workers",
    ALONE: "rounds of one attempt, which the client makes itself",
    "answers": "answers read from the store",
    "learn": "partial models joined",
    "withdraw": "scans withdrawn, evidence of all",
    "adjust": "joint refinement",
}


def main() -> None:
    """Measure what is not measured yet, simulate, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scans", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=64)
    parser.add_argument("--from", type=int, nargs="+", default=(75, 150, 300), dest="sizes")
    parser.add_argument("--scheduler", type=float, default=SCHEDULER, help="seconds a tile")
    parser.add_argument("--folder", type=Path, default=Path("runs/bench/cluster"))
    asked = parser.parse_args()
    if len(set(asked.sizes)) < 2:
        parser.error("--from: expected two numbers of scans at least, to tell how the work grows")
    traces = [kept(size, asked.folder) for size in sorted(set(asked.sizes))]
    print(page(traces, asked.scans, asked.workers, asked.scheduler))


def page(traces: Sequence[Trace], scans: int, workers: int, scheduler: float) -> str:
    """What was measured, and what comes of it: tables of Markdown."""
    largest = traces[-1]
    grown = growth(traces)
    client = {part: one(scans) for part, one in grown.items()}
    rounds = with_client(replayed(largest, scans), client)
    attempts = sum(len(one.tasks) for one in rounds)

    def run(count: int, scheduler: float = scheduler, prepared: bool = False) -> Cluster:
        return simulated(rounds, client, count, scans, largest.read, scheduler, prepared)

    alone, found, free = run(1), run(workers), run(workers, scheduler=0.0)
    better = run(workers, prepared=True)
    lines = [
        "## Measured", "",
        *markdown(("scans", "placed", "rounds", "attempts", "s an attempt", *grown), [
            row_of(trace) for trace in traces
        ]),
        "", "## Growth of the client's work", "",
        *markdown(("part", "power of the scans", f"s for {scans:,}"), [
            [PARTS[part], f"{one.exponent:.2f}", f"{client[part]:.0f}"]
            for part, one in grown.items()
        ]),
        "", f"## {scans:,} scans, {workers} workers", "",
        f"{len(rounds)} rounds, {attempts:,} attempts.", "",
        *markdown(("of the critical path", "s", "share", "s, scans prepared by workers"), [
            [PARTS[part], f"{seconds:.0f}", f"{seconds / found.clock:.1%}",
             f"{better.path.get(part, 0.0):.0f}"]
            for part, seconds in found.path.items()
        ]),
        "",
        *markdown(("", "s", "speed-up", "efficiency"), [
            verdict("one worker", alone, alone, 1),
            verdict(f"{workers} workers", found, alone, workers),
            verdict("and a scheduler that takes no time", free, alone, workers),
            verdict("and scans prepared by workers", better, alone, workers),
            spread(better, alone, workers, client["scores"] + client["adjust"]),
            *without(found, alone, workers),
        ]),
        "",
        *markdown(("attempts in a round", "rounds", "attempts", "s", "efficiency in them"),
                  by_size(found)),
        "",
        f"The workers work for {found.worked:.0f} s, evenly {found.worked / workers:.0f} s each.",
    ]  # fmt: skip
    return "\n".join(lines)


def row_of(trace: Trace) -> list[str]:
    """What was measured of a run."""
    tasks = [seconds for one in trace.rounds for seconds, _ in one.tasks]
    return [
        str(trace.scans), str(trace.placed), str(len(trace.rounds)), str(len(tasks)),
        f"{sum(tasks) / max(1, len(tasks)):.3f}",
        *(f"{seconds:.2f}" for seconds in client_seconds(trace).values()),
    ]  # fmt: skip


def verdict(what: str, found: Cluster, alone: Cluster, workers: int) -> list[str]:
    """Time, speed-up over one worker, and how much of the workers that is."""
    return [what, *_figures(found.clock, alone.clock, workers)]


def spread(found: Cluster, alone: Cluster, workers: int, seconds: float) -> list[str]:
    """As if so many of the client's seconds were the workers', evenly."""
    clock = found.clock - seconds * (1 - 1 / workers)
    what = "and scores and joint refinement divided evenly among workers, too"
    return [what, *_figures(clock, alone.clock, workers)]


def by_size(found: Cluster) -> list[list[str]]:
    """Large rounds and small ones: how many, what they took, and how much of the workers."""
    rows = []
    limits = (0, 1, found.workers - 1, 4 * found.workers - 1, float("inf"))
    for low, high in pairwise(limits):
        some = [one for one in found.rounds if low < one[0] <= high]
        if not some:
            continue
        attempts, spent, worked = (sum(column) for column in zip(*some, strict=True))
        size = f"{low + 1:g} to {high:g}" if high < float("inf") else f"more than {low:g}"
        rows.append([
            "1" if high == 1 else size, str(len(some)), f"{attempts:,}", f"{spent:.0f}",
            f"{worked / max(spent, 1e-9) / found.workers:.2f}",
        ])  # fmt: skip
    return rows


def without(found: Cluster, alone: Cluster, workers: int) -> list[list[str]]:
    """As if the client's parts took no time, the longest first, until six tenths are reached."""
    rows, clock, single = [], found.clock, alone.clock
    parts = sorted(found.path.items(), key=lambda one: -one[1])
    for part, seconds in parts:
        if part == WORKERS:
            continue
        clock, single = clock - seconds, single - seconds
        rows.append([f"and without: {PARTS[part]}", *_figures(clock, single, workers)])
        if single / clock / workers >= 0.6:
            break
    return rows


def _figures(clock: float, alone: float, workers: int) -> list[str]:
    return [f"{clock:.0f}", f"{alone / clock:.1f}", f"{alone / clock / workers:.2f}"]


if __name__ == "__main__":
    main()
