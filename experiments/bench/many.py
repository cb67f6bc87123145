"""How the cost grows to hundreds and thousands of scans; workers, and what a killed run has lost.

    python -m experiments.bench.many
    python -m experiments.bench.many column-300 column-300-dask2 --folder runs/bench/many
    python -m experiments.bench.many --within 580    # again and again, until all are measured

A column is scanned by a sensor that climbs around it: a scan overlaps a few others. Around the
figurine each scan meets most others. Every case is a process of its own; what is measured is kept
in the folder, and not measured again by the same code. Prints the table as Markdown.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from mvreg.report.comparison.formats import markdown
from mvreg.report.run_folder import write_text
from mvreg.store.content import versions

SCANS = Path("runs/bench/scans/many")
#: Points of a scan.
POINTS = 10_000
CASES = (
    *(f"column-{views}" for views in (20, 60, 150, 300, 1000)),
    *(f"around-{views}" for views in (15, 30, 60, 120, 250, 500)),
    "column-300-dask1", "column-300-dask2", "column-300-again", "column-300-killed",
)  # fmt: skip
COLUMNS = ("case", "placed", "false", "attempts", "seconds", "CPU", "MB", "mean error (mm)")
#: A scan farther from its truth than this (degrees) is a false positive.
FALSE = 2.0


def main() -> None:
    """Measure the cases that the command line names, all by default."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", default=CASES)
    parser.add_argument("--folder", type=Path, default=Path("runs/bench/many"))
    parser.add_argument("--limit", type=float, help="seconds that one case may take")
    parser.add_argument(
        "--within", type=float, help="seconds after which no case is begun, and none goes on"
    )
    parser.add_argument("--one", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        print(json.dumps(measured(chosen.one)))
        return
    lines = table(chosen.cases, chosen.folder, chosen.limit, within=chosen.within)
    print("\n".join(lines))


def table(
    cases: Sequence[str],
    folder: Path,
    limit: float | None = None,
    say: Callable[[str], None] = lambda text: None,
    within: float | None = None,
) -> list[str]:
    """What the cases have measured, now or before, as lines of Markdown.

    Parameters
    ----------
    cases : sequence of str
        As in `CASES`: ``column-300-dask2``.
    folder : Path
        Where each is kept as soon as it is measured.
    limit : float, optional
        Seconds that one may take; what took longer is told, and measured again with a longer one.
    say : callable
        Is told of each.
    within : float, optional
        Seconds for all: the case that is under way then is ended, and those after it are not begun.
        The same command again goes on with them.
    """
    folder.mkdir(parents=True, exist_ok=True)
    end = None if within is None else time.monotonic() + within
    rows = []
    for case in cases:
        one, before = row(case, folder, least(limit, end))
        rows.append(one)
        say(f"many {case}: {'kept from before' if before else one.get('seconds', 'failed')}")
    return markdown(COLUMNS, [[str(one.get(name, "")) for name in COLUMNS] for one in rows])


def least(limit: float | None, end: float | None) -> float | None:
    """Seconds for a case: its own limit, or what is left until the end (s, of the clock)."""
    left = [] if end is None else [max(0.0, end - time.monotonic())]
    return min([*left, *([] if limit is None else [limit])], default=None)


def row(case: str, folder: Path, limit: float | None = None) -> tuple[dict[str, Any], bool]:
    """What a case has measured, and whether that was before."""
    file = folder / f"{case}_{versions()[:12]}.json"
    if file.exists():
        found: dict[str, Any] = json.loads(file.read_text())
        return found, True
    if limit is not None and limit <= 0:
        return {"case": case, "seconds": "not measured yet"}, False
    command = [sys.executable, "-m", "experiments.bench.many", "--one", case]
    # A session of its own: its workers end with it.
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as child:
        try:
            printed, _ = child.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            return {"case": case, "seconds": f"longer than {limit:g} s"}, False
        except BaseException:
            os.killpg(child.pid, signal.SIGKILL)
            raise
    if child.returncode:
        return {"case": case, "placed": f"failed, {child.returncode}"}, False
    write_text(file, printed.splitlines()[-1])
    return json.loads(file.read_text()), False


def measured(case: str) -> dict[str, Any]:
    """Run one case in this process."""
    from mvreg.execution import Dask, Threads
    from mvreg.store.folder import FolderStore, NoStore

    kind, views, *how = case.split("-")
    scanset = scans(kind, int(views))
    with tempfile.TemporaryDirectory(prefix="mvreg-many-") as place:
        store = FolderStore(Path(place), 50 * 10**9) if how else NoStore()
        if how == ["killed"]:
            kill_one(kind, views, place)
        elif how == ["again"]:
            registered(scanset, store, Threads())
        workers = int(how[0][4:]) if how and how[0].startswith("dask") else 0
        executor = Dask(workers=workers) if workers else Threads()
        return {"case": case, **registered(scanset, store, executor)}


def scans(kind: str, views: int) -> Any:
    """The scans of a case, in random order, each moved at random."""
    import numpy as np

    from experiments.bench.column import Column, keep
    from mvreg.datasets.base import Order
    from mvreg.datasets.synthetic import Figurine

    rng = np.random.default_rng(1)
    if kind == "around":
        return Figurine(views=views, points=POINTS, order=Order.shuffle, scramble=True)(rng)
    keep(SCANS, views, POINTS, 1.0)
    return Column(folder=str(SCANS), views=views, order=Order.shuffle, scramble=True)(rng)


def registered(scanset: Any, store: Any, executor: Any) -> dict[str, Any]:
    """Register the scans with the default method."""
    import numpy as np

    from mvreg.evaluation.pose_errors import pose_errors
    from mvreg.events import ignore
    from mvreg.parallel import quick_turns
    from mvreg.run import load_method, run

    quick_turns()
    method = load_method("auto")
    start, cpu = time.perf_counter(), time.process_time()
    result, _, _ = run(scanset.scans, method, np.random.default_rng(1), ignore, store, executor)
    seconds, spent = time.perf_counter() - start, time.process_time() - cpu
    errors = pose_errors(result.poses, scanset.poses, result.reference)
    assert errors is not None
    wrong = [one for one in errors.scans.values() if one.angle > FALSE]
    return {
        "placed": f"{len(result.poses)} of {len(scanset.scans)}",
        "false": len(wrong),
        "attempts": f"{len(result.pairs) / len(scanset.scans):.2f} a scan",
        "seconds": round(seconds, 1),
        "CPU": round(spent, 1),
        "MB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
        "mean error (mm)": round(errors.mean.translation, 3),
    }


def kill_one(kind: str, views: str, place: str) -> None:
    """Let another process work with a store until half of the attempts are there, and kill it."""
    code = (
        "import sys; from pathlib import Path; from experiments.bench import many; "
        "from mvreg.execution import Threads; from mvreg.store.folder import FolderStore; "
        "many.registered(many.scans(sys.argv[1], int(sys.argv[2])), "
        "FolderStore(Path(sys.argv[3]), 5 * 10**10), Threads())"
    )
    child = subprocess.Popen([sys.executable, "-c", code, kind, views, place], env=os.environ)
    while child.poll() is None and entries(place) < 1.5 * int(views):
        time.sleep(0.01)
    child.send_signal(signal.SIGKILL)
    child.wait()


def entries(place: str) -> int:
    """How many entries a store has."""
    return sum(1 for _ in Path(place).rglob("*.safetensors"))


if __name__ == "__main__":
    main()
