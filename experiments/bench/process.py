"""Start a process, wait for it, and read what it measured inside itself."""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from experiments.bench.plan import Case
from experiments.bench.records import TOO_LONG

REPOSITORY = Path(__file__).resolve().parents[2]
MICRO = REPOSITORY / "experiments" / "micro"
#: Exit code of a run that did not place every scan; it is measured all the same.
NOT_PLACED = 3
#: How the last line of a traceback begins; more lines of the message may follow it.
RAISED = re.compile(r"(error|[\w.]+(Error|Exception|Exit)): ")
#: What is kept of a micro-benchmark, in seconds but for the number of rounds.
STATISTICS = ("median", "min", "max", "rounds")


@dataclass(frozen=True)
class Measured:
    """What came of a process: the fields of `bench_records.Record` of the same names."""

    answer: Mapping[str, Any] | None
    error: str | None
    wall: float | None
    others: float | None


def measure(case: Case, limit: float) -> Measured:
    """Run a case in a process of its own, for `limit` seconds at most."""
    with tempfile.TemporaryDirectory(prefix="mvreg-bench-") as folder:
        file = Path(folder) / "answer.json"
        found = waited([sys.executable, *words(case, file)], limit, Path(folder))
        if found.error is not None or case.part == "start":
            return found
        if not file.is_file():
            return replace(found, error="the process left no answer")
        answer = json.loads(file.read_text("utf-8"))
    return replace(found, answer=summed_up(answer) if case.part == "micro" else answer)


def words(case: Case, file: Path) -> list[str]:
    """What a case's process is started with, which leaves its answer in `file`."""
    if case.part == "start":
        run = "hydra.run.dir=" + str(file.parent / "run")
        more = [] if "--help" in case.spec["words"] else [run]
        return ["-m", "mvreg", *case.spec["words"], *more]
    if case.part == "micro":
        return ["-m", "pytest", str(MICRO), "-q", "-p", "no:cacheprovider", "-p", "no:xdist",
                "--benchmark-only", f"--benchmark-json={file}"]  # fmt: skip
    return ["-m", "experiments.bench.child", json.dumps(dict(case.spec)), str(file)]


def waited(command: Sequence[str], limit: float, folder: Path) -> Measured:
    """Run a command to its end; `folder` is for what it prints."""
    busy, own, start = busy_seconds(), cpu_seconds(), time.perf_counter()
    with (folder / "printed").open("w+") as printed:
        try:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=printed, stderr=printed, timeout=limit,
                check=False, cwd=REPOSITORY,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return Measured(None, f"{TOO_LONG} {limit:g} s", limit, None)
        wall = time.perf_counter() - start
        printed.seek(0)
        lines = printed.read().strip().splitlines()
    others = None
    if busy is not None and (now := busy_seconds()) is not None:
        others = max(0.0, (now - busy - (cpu_seconds() - own)) / wall)
    error = None
    if done.returncode < 0:
        error = f"ended by signal {-done.returncode}"
    elif done.returncode not in (0, NOT_PLACED):
        error = message(lines) or f"exit code {done.returncode}"
    return Measured(None, error, wall, others)


def message(lines: Sequence[str]) -> str:
    """What a process that failed said: its last exception, or else its last line."""
    raised = [line for line in lines if RAISED.match(line)]
    return [*lines[-1:], *raised[-1:]][-1] if lines else ""


def cpu_seconds() -> float:
    """Processor time of this process and those that it has waited for."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def busy_seconds() -> float | None:
    """Processor time of the whole machine since it started; None where Linux does not tell.

    With what the host of a virtual machine took away from it ("stolen").
    """
    file = Path("/proc/stat")
    if not file.is_file():
        return None
    ticks = [int(each) for each in file.read_text("utf-8").split("\n", 1)[0].split()[1:]]
    user, nice, system, _, _, irq, softirq, stolen, *_ = ticks
    return (user + nice + system + irq + softirq + stolen) / os.sysconf("SC_CLK_TCK")


def summed_up(answer: Mapping[str, Any]) -> dict[str, Any]:
    """What is kept of the file that pytest-benchmark writes."""
    rows = [
        {"group": each["group"] or "", "name": each["name"]}
        | {name: each["stats"][name] for name in STATISTICS}
        for each in answer["benchmarks"]
    ]
    return {"benchmarks": rows}


def kept_scans(folder: Path, views: int, points: int, step: float) -> None:
    """See to it that the scans of the column are there, which another process makes.

    Raises
    ------
    subprocess.CalledProcessError
        If that fails; it has said why.
    """
    if all((folder / f"column_{index:03d}.npz").is_file() for index in range(views)):
        return
    command = [
        "-m",
        "experiments.bench.column",
        str(folder),
        f"--views={views}",
        f"--points={points}",
        f"--step={step}",
    ]
    subprocess.run([sys.executable, *command], check=True, cwd=REPOSITORY)
