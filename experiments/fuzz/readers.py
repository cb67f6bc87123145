"""Read damaged files of every format, many more than the tests do.

    nice -n 19 python -m experiments.fuzz.readers --files 1000000
    nice -n 19 python -m experiments.fuzz.readers --files 1000000 --minutes 15

Each file is read whole and in pieces, in a worker process that may take ten seconds of the
processor and ten times the file, and a floor, of memory. How far the job has come is kept: the same
command goes on where it was cut short, until the code changes. At the end a table by format, and
what is wrong with the name of the good file and the seed that makes the damaged one again: an
exception other than `InputError`, a warning, other points in pieces, a worker that dies or hangs.
These files are not kept.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path

import psutil
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from experiments.fuzz.files import good_files
from experiments.fuzz.tally import Tally
from experiments.fuzz.worker import FINE, work
from mvreg.store.content import versions

#: Files per message to a worker.
BATCH = 100
#: Seconds of the processor that one file may take, and seconds in all, on a machine that is busy.
LIMIT, LONGEST = 10.0, 120.0
#: Seconds until a worker is ready.
START = 300.0


class Reader:
    """A worker process, started anew where one has died or hung."""

    def __init__(self) -> None:
        self.process: SpawnProcess | None = None
        self.pipe: Connection | None = None

    def read(self, name: str, seeds: range) -> Iterator[tuple[int, str]]:
        """What each file comes to."""
        while seeds:
            pipe = self.ready()
            pipe.send((name, seeds))
            at = seeds[0]
            while seeds:
                found = self.answer(at)
                if found is None:
                    continue
                at, what = found
                if what:
                    yield at, what
                    seeds = range(at + 1, seeds.stop)
                if self.pipe is None:
                    break

    def answer(self, at: int) -> tuple[int, str] | None:
        """The next message; that the worker died or hung at a seed."""
        assert self.pipe is not None and self.process is not None
        try:
            spent, began = self.spent(), time.monotonic()
            last = began
            while not self.pipe.poll(1.0):
                now = time.monotonic()
                if now - last > LONGEST / 2:  # both of us were stopped
                    began += now - last
                last = now
                if self.spent() - spent > LIMIT or time.monotonic() - began > LONGEST:
                    self.stop()
                    return at, "hangs"
            seed, what = self.pipe.recv()
            return int(seed), str(what)
        except (EOFError, OSError, psutil.NoSuchProcess):
            self.stop()
            return at, "the process died"

    def spent(self) -> float:
        """Seconds of the processor that the worker has taken."""
        assert self.process is not None
        times = psutil.Process(self.process.pid).cpu_times()
        return float(times.user + times.system)

    def ready(self) -> Connection:
        """The way to a worker that has loaded all that it needs."""
        if self.pipe is None:
            spawn = multiprocessing.get_context("spawn")
            self.pipe, other = spawn.Pipe()
            self.process = spawn.Process(target=work, args=(other,), daemon=True)
            self.process.start()
            other.close()
            if not self.pipe.poll(START):
                raise SystemExit("a worker does not start")
            self.pipe.recv()
        return self.pipe

    def stop(self) -> None:
        """End the worker."""
        if self.process is not None:
            self.process.kill()
            self.process.join()
        self.process = self.pipe = None


def batches(names: list[str], tally: Tally, each: int) -> Iterator[tuple[str, range]]:
    """What is still to be read of so many files of each name, in turn."""
    for start in range(0, each, BATCH):
        for name in names:
            seeds = range(max(start, tally.next.get(name, 0)), min(start + BATCH, each))
            if seeds:
                yield name, seeds


def run(tally: Tally, names: list[str], each: int, minutes: float, console: Console) -> bool:
    """Read what is left, for so long at most; whether all has been read."""
    reader, before, began = Reader(), tally.seconds, time.monotonic()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
               TimeRemainingColumn(), TextColumn("{task.fields[wrong]} wrong"))  # fmt: skip
    with Progress(*columns, console=console, speed_estimate_period=600) as bar:
        total = each * len(names)
        left = sum(max(0, each - tally.next.get(name, 0)) for name in names)
        task = bar.add_task("", total=total, completed=total - left, wrong=len(tally.wrong))
        try:
            for name, seeds in batches(names, tally, each):
                if time.monotonic() - began > 60 * minutes:
                    return False
                bar.update(task, description=name)
                for seed, found in reader.read(name, seeds):
                    tally.add(name, seed, found, FINE)
                    if found not in FINE:
                        console.print(f"{name}, seed {seed}: {found}", markup=False)
                    bar.update(task, advance=1, wrong=len(tally.wrong))
                tally.seconds = before + time.monotonic() - began
                tally.save()
        finally:
            reader.stop()
    return True


def main(arguments: list[str] | None = None) -> int:
    """Go on with the job that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=100_000, help="in all")
    parser.add_argument("--only", default="", help="names of good files that contain this")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="for so long at most")
    parser.add_argument("--folder", type=Path, default=Path("runs/fuzz"), help="where it is kept")
    asked = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        names = [name for name in good_files(Path(folder)) if asked.only in name]
    if not names:
        parser.error(f"--only {asked.only}: there is no such file")
    tally = Tally.of(asked.folder / f"readers_{versions()[:12]}.json")
    console = Console()
    finished = run(tally, names, -(-asked.files // len(names)), asked.minutes, console)
    console.print(tally.table(FINE))
    for name, seed, what in tally.wrong:
        console.print(f"{name}, seed {seed}: {what}", markup=False)
    rest = "all of them" if finished else "cut short; the same command goes on"
    console.print(f"{tally.files:,} files in {tally.seconds:.0f} s, {rest}")
    return 1 if tally.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
