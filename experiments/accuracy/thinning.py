"""How many points of a large scan registration needs: accuracy, time and memory over their number.

    python -m experiments.accuracy.thinning --sets figurine room --most 0 1000000 500000 100000

Writes the scans of a set, made with `--points` points each, into a folder, and registers them with
`dataset.most_points` as given, 0 for all, a process each. Errors are against the exact poses, in
the unit of the set; medians over `--draws` draws of the noise.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import mvreg
from mvreg.io import write_ply

#: What sets the number of points of each set.
POINTS = {"figurine": "points", "room": "rays", "office": "rays", "desk": "rays"}
NOISE = {"figurine": "noise_rng"}
SENSOR = {"room": "origin", "office": "origin", "desk": "origin"}


def write(folder: Path, name: str, points: int, draw: int) -> None:
    """The scans in random frames, and the true poses."""
    drawn = {NOISE[name]: draw} if name in NOISE else {}
    scans = mvreg.dataset(name, rng=draw, **{POINTS[name]: points}, **drawn)
    folder.mkdir(parents=True)
    for scan in scans.scans:
        write_ply(folder / f"{scan.name}.ply", scan.points)
    poses = {f"{scan}.ply": pose.tolist() for scan, pose in (scans.poses or {}).items()}
    (folder / "poses.json").write_text(json.dumps(poses))


def register(folder: Path, name: str, most: int) -> dict[str, float]:
    """Register a folder in a process of its own; what came of it."""
    run = folder.parent / f"{folder.name}_{most}"
    before = time.perf_counter()
    child = subprocess.Popen(
        [sys.executable, "-m", "mvreg", f"dataset.path={folder}", "dataset=folder",
         f"dataset.most_points={most}", "dataset.ground_truth=poses.json", "rerun=false",
         "dataset.pattern=*.ply", f"dataset.sensor={SENSOR.get(name, 'auto')}",
         f"hydra.run.dir={run}"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    _, _, usage = os.wait4(child.pid, 0)
    spent = time.perf_counter() - before
    report = json.loads((run / "result.json").read_text())
    errors = report["errors"]["mean"]
    return {
        "placed": len(report["poses"]),
        "e_R": errors["rotation"],
        "e_t": errors["translation"],
        "seconds": spent,
        "registration": report["seconds"]["total"],
        "MB": usage.ru_maxrss / 1024,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", nargs="+", default=["figurine", "room"], choices=POINTS)
    parser.add_argument("--points", type=int, default=1_500_000)
    parser.add_argument("--most", nargs="+", type=int, default=[0, 1000000, 500000, 200000, 50000])
    parser.add_argument("--draws", type=int, default=3)
    arguments = parser.parse_args()
    for name in arguments.sets:
        columns = ("points held", "placed", "e_R", "e_t", "s", "registration, s", "MB")
        table = Table(*columns, title=name)
        rows: dict[int, list[dict[str, float]]] = {most: [] for most in arguments.most}
        for draw in range(arguments.draws):
            with tempfile.TemporaryDirectory() as folder:
                scans = Path(folder) / "scans"
                # Elsewhere: the processes started here are born with this one's memory.
                writer = get_context("spawn").Process(
                    target=write, args=(scans, name, arguments.points, draw)
                )
                writer.start()
                writer.join()
                for most in arguments.most:
                    rows[most].append(register(scans, name, most))
        for most, found in rows.items():
            middle = {key: float(np.median([row[key] for row in found])) for key in found[0]}
            table.add_row(
                f"{most:,}" if most else "all", f"{middle['placed']:g}",
                f"{middle['e_R']:.2g}", f"{middle['e_t']:.3g}", f"{middle['seconds']:.1f}",
                f"{middle['registration']:.1f}", f"{middle['MB']:.0f}",
            )  # fmt: skip
        Console().print(table)


if __name__ == "__main__":
    main()
