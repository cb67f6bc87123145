"""Read damaged files of every format, many more than the tests do.

    python -m experiments.fuzz.readers --files 1000000

Each file is read in a worker process with a time limit. What is wrong is printed, with the name of
the good file and the seed that makes the damaged one again: an exception other than `InputError`,
a warning, a worker that dies or hangs.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from experiments.fuzz.files import damaged, good_files
from mvreg.errors import InputError
from mvreg.io import read_clouds

#: Files per message to a worker, and seconds that one file may take.
BATCH, LIMIT = 100, 10.0
#: Of a worker, in bytes: the libraries and ten times any file here are far below it.
MEMORY = 8 << 30


def outcome(path: Path) -> str:
    """What reading a file comes to: "points", "refused", or what is wrong."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            clouds = read_clouds(path)
        except InputError as error:
            return "refused" if str(path) in str(error) else f"error without file: {error}"
        except Exception:
            last = traceback.extract_tb(sys.exc_info()[2])[-1]
            return f"{sys.exc_info()[1]!r} in {Path(last.filename).name}:{last.lineno}"
    good = all(len(cloud.points) and np.isfinite(cloud.points).all() for cloud in clouds)
    return "points" if clouds and good else "no points, or not finite ones"


def work(pipe: Connection) -> None:
    """Read the files of (name, seeds), and answer (seed, outcome) before and after each."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    with tempfile.TemporaryDirectory() as folder:
        good = good_files(Path(folder))
        while (job := pipe.recv()) is not None:
            name, seeds = job
            path = Path(folder) / f"damaged-{name}"
            for seed in seeds:
                path.write_bytes(damaged(good[name], np.random.default_rng(seed)))
                pipe.send((seed, ""))
                pipe.send((seed, outcome(path)))


def batch(pipe: Connection, name: str, seeds: range, counts: Counter[str]) -> int | None:
    """Have some files read; the seed at which the worker died or hung, or None."""
    pipe.send((name, seeds))
    at, left = seeds[0], len(seeds)
    while left:
        try:
            if not pipe.poll(LIMIT):
                print(f"{name}, seed {at}: hangs", flush=True)
                return at
            at, found = pipe.recv()
        except EOFError:
            print(f"{name}, seed {at}: the process died", flush=True)
            return at
        if found:
            left -= 1
            counts[found if found in ("points", "refused") else "wrong"] += 1
            if found not in ("points", "refused"):
                print(f"{name}, seed {at}: {found}", flush=True)
    return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=100_000)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--only", default="", help="names of good files that contain this")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        names = [name for name in good_files(Path(folder)) if asked.only in name]
    spawn = multiprocessing.get_context("spawn")
    counts: Counter[str] = Counter()
    began, worker, pipe = time.time(), None, None
    for start in range(asked.first, asked.first + asked.files // len(names), BATCH):
        for name in names:
            seeds = range(start, start + BATCH)
            while seeds:
                if worker is None or pipe is None:
                    pipe, other = spawn.Pipe()
                    worker = spawn.Process(target=work, args=(other,), daemon=True)
                    worker.start()
                    other.close()
                stopped = batch(pipe, name, seeds, counts)
                if stopped is None:
                    break
                counts["wrong"] += 1
                worker.kill()
                worker, pipe = None, None
                seeds = range(stopped + 1, seeds[-1] + 1)
    if pipe is not None:
        pipe.send(None)
    total = sum(counts.values())
    print(f"{total:,} files in {time.time() - began:.0f} s: {dict(counts)}")
    sys.exit(1 if counts["wrong"] else 0)


if __name__ == "__main__":
    main()
