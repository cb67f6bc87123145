"""Measure mvreg's methods and the peers on the same scans, each run in a process of its own.

    python -m experiments.bench.run                           # everything
    python -m experiments.bench.run methods start --rounds 5  # times on real scans; whole commands
    python -m experiments.bench.run scans --sizes 10 20 40    # growth with the number of scans
    python -m experiments.bench.run many --cases column-300   # many scans, workers

One process runs after another and in turn, so that no method always goes first. What is finished
is on disk at once: the same command goes on where it was cut short, as long as the code is the
same. Prints tables, keeps every run in ``runs/bench/bench.json``; ``make report`` makes the page.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import fields, replace
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from experiments.bench.many import CASES, table
from experiments.bench.plan import DATASETS, OWN, PARTS, PEERS, Case, Options, plan
from experiments.bench.process import Measured, kept_scans, measure
from experiments.bench.records import TOO_LONG, Context, Record, context, done, load, same, save
from experiments.bench.show import show

ROOT = Path(__file__).resolve().parents[2] / "runs" / "bench"
#: Many scans, each case of which is kept in a file of its own.
MANY = "many"
ALL = (*PARTS, MANY)
#: A child process may take so long (s).
LIMIT = 1800.0


class Bench:
    """The file of records, and what is added to it."""

    def __init__(self, file: Path, limit: float, console: Console, again: bool = False) -> None:
        self.file, self.limit, self.console = file, limit, console
        self.records = load(file)
        self.now = context()
        self.finished = set() if again else done(self.records, self.now, limit)

    def run(self, todo: Iterable[tuple[Case, int]]) -> None:
        """Measure what is not measured yet.

        Raises
        ------
        SystemExit
            If the code changes meanwhile: what came before would be of another one.
        """
        for case, number in todo:
            if (case.key, number) in self.finished:
                self.say(case, number, "kept from before")
                continue
            self.add(case, number, self.measured(case))

    def measured(self, case: Case) -> Measured:
        """One case; not run where a smaller one of the same took too long."""
        for r in self.records:
            alike = (r.part, r.row) == (case.part, case.row) and same(r.context, self.now)
            if alike and r.size < case.size and r.too_long and (r.wall or 0) >= self.limit:
                why = f"{TOO_LONG} {self.limit:g} s with {r.size} already"
                return Measured(None, why, self.limit, None)
        if case.column is not None:
            kept_scans(*case.column)
        return measure(case, self.limit)

    def add(self, case: Case, number: int, found: Measured) -> None:
        """Keep what was measured."""
        if not same(context(), self.now):
            raise SystemExit("the code changed while it was measured; start again")
        self.records.append(record(case, number, found, self.now))
        save(self.file, self.records)
        seconds = (found.answer or {}).get("seconds", found.wall)
        self.say(case, number, found.error or f"{seconds:.2f} s")

    def say(self, case: Case, number: int, text: str) -> None:
        """A line about a case."""
        where = f"{case.part} {case.group}, round {number + 1}: {case.row}"
        self.console.print(f"{where}: {text}", style="dim", highlight=False, markup=False)


def record(case: Case, number: int, found: Measured, now: Context) -> Record:
    """What is kept of a measurement."""
    return Record(
        case.part, case.row, case.group, case.size, case.key, number, found.answer, found.error,
        found.wall, found.others, datetime.now(UTC).isoformat(timespec="seconds"), now, case.spec,
    )  # fmt: skip


def parser() -> argparse.ArgumentParser:
    """The command line."""
    words = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    usual = Options()
    add = words.add_argument
    add("parts", nargs="*", metavar="part", help=f"of {', '.join(ALL)}; all if none is named")
    add(
        "--only",
        nargs="+",
        dest="methods",
        metavar="METHOD",
        default=usual.methods,
        help=f"methods, of {', '.join((*OWN, *PEERS))}; usually {', '.join(usual.methods)}",
    )
    add("--datasets", nargs="+", default=DATASETS, help="for the part methods")
    add("--peers-on", nargs="*", default=usual.peers_on, help="data sets that peers run on, too")
    add("--rounds", type=int, default=usual.rounds, help="of the parts methods and start")
    add(
        "--growth-rounds",
        type=int,
        default=usual.growth_rounds,
        help="of scans and points; each in another order",
    )
    add("--sizes", nargs="+", type=int, default=usual.sizes, help="numbers of scans")
    add("--points", nargs="+", type=int, default=usual.points, help="numbers of points per scan")
    add("--scan-points", type=int, default=usual.scan_points, help="points per scan in scans")
    add("--scan-count", type=int, default=usual.scan_count, help="number of scans in points")
    add("--cases", nargs="+", default=CASES, help="of many, such as column-300-dask2")
    add("--shuffle", action="store_true", help="methods on scans in random order, moved at random")
    add("--limit", type=float, default=LIMIT, help="seconds that one process may take")
    add("--file", type=Path, default=ROOT / "bench.json", help="where every run is kept")
    add("--again", action="store_true", help="measure again what is measured already")
    return words


def main(arguments: list[str] | None = None) -> int:
    """Measure, keep, print."""
    words = parser()
    chosen = words.parse_args(arguments)
    asked = tuple(chosen.parts or ALL)
    if wrong := set(asked) - set(ALL):
        words.error(f"no part {', '.join(sorted(wrong))}; there are: {', '.join(ALL)}")
    parts = tuple(part for part in asked if part != MANY)
    given = {f.name: getattr(chosen, f.name) for f in fields(Options) if hasattr(chosen, f.name)}
    options = replace(Options(), **{**given, "parts": parts, "scans": chosen.file.parent / "scans"})
    console = Console(width=None if sys.stdout.isatty() else 160)
    bench = Bench(chosen.file, chosen.limit, console, chosen.again)
    bench.run(plan(options))
    if parts:
        show(bench.records, parts, console)
    if MANY in asked:
        place = chosen.file.parent / MANY
        for line in table(chosen.cases, place, chosen.limit, console.print):
            console.print(line, markup=False, highlight=False, soft_wrap=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
