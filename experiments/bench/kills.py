"""Processes killed at random moments: nothing half written, and the same answer afterwards.

    python -m experiments.bench.kills --moments 50

Runs the smallest set again and again, kills each process (SIGKILL) at a moment drawn at random, and
lets another go on with its store. Ends with 1 if a ``result.json`` cannot be read, an entry of the
store is damaged, or the poses differ from those of a run that nothing disturbed.
"""

from __future__ import annotations

import argparse
import json
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.progress import track

from experiments.bench.interrupts import RUN, duration, started
from mvreg.store import entries
from mvreg.store.codec import EntryError
from mvreg.store.folder import FolderStore


def main() -> int:
    """Kill as often as the command line says, and tell what was seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moments", type=int, default=50)
    parser.add_argument("--rng", type=int, default=0)
    chosen = parser.parse_args()
    rng = np.random.default_rng(chosen.rng)
    with tempfile.TemporaryDirectory(prefix="mvreg-kills-") as place:
        here = Path(place)
        expected = poses(here / "alone", "store=false")
        length, faults, lost = duration(words(here / "timed", "store=false")), [], []
        for _ in track(range(chosen.moments), "killing"):
            shutil.rmtree(here / "store", ignore_errors=True)
            moment = float(rng.uniform(0, length))
            faults += killed(here, moment)
            before = time.perf_counter()
            if poses(here / "again", f"store={here / 'store'}") != expected:
                faults.append(f"killed after {moment:.2f} s: other poses")
            lost.append(time.perf_counter() - before)
    print(f"{chosen.moments} kills within {length:.1f} s; going on took {np.median(lost):.1f} s")
    print("\n".join(faults) or "nothing half written, the same poses every time")
    return 1 if faults else 0


def words(folder: Path, store: str) -> tuple[str, ...]:
    """The command, with a folder for its run."""
    return (*RUN, store, f"hydra.run.dir={folder}")


def poses(folder: Path, store: str) -> object:
    """The poses that a run comes to by itself."""
    subprocess.run(
        [sys.executable, "-m", "mvreg", *words(folder, store)], check=True, capture_output=True
    )
    return json.loads((folder / "result.json").read_text())["poses"]


def killed(here: Path, moment: float) -> list[str]:
    """Kill a run after so many seconds: what it has left half written."""
    folder, store = here / "killed", here / "store"
    shutil.rmtree(folder, ignore_errors=True)
    child = started(words(folder, f"store={store}"), here)
    (here / "sign").unlink(missing_ok=True)
    time.sleep(moment)
    child.send_signal(signal.SIGKILL)
    child.communicate()
    found = []
    for _, _, file in FolderStore(store, 10**9).known():
        try:
            entries.verified(file, file.stem)
        except EntryError as error:
            found.append(f"killed after {moment:.2f} s: {file}: {error}")
    report = folder / "result.json"
    if report.exists():
        try:
            json.loads(report.read_text())
        except ValueError as error:
            found.append(f"killed after {moment:.2f} s: {report}: {error}")
    return found


if __name__ == "__main__":
    sys.exit(main())
