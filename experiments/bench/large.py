"""Time and peak memory of a folder of large scans, beside another build of mvreg.

    python -m experiments.bench.large --points 5000000 --beside ../before/.venv/bin/python

Writes ten scans of the figurine with colours as binary PLY, in single precision as scanners do, and
registers the folder with each interpreter in turn. Peak memory is the largest resident set of the
process (`VmHWM`), read by the kernel's accounting of children.
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


def write(folder: Path, scans: int, points: int) -> None:
    """The scans, and their true poses."""
    import mvreg

    folder.mkdir(parents=True, exist_ok=True)
    kinds = [(axis, "<f4") for axis in "xyz"] + [(c, "u1") for c in ("red", "green", "blue")]
    found = mvreg.dataset("figurine", views=scans, points=points, scramble=True)
    for scan in found.scans:
        table = np.zeros(len(scan.points), dtype=kinds)
        for axis, column in zip("xyz", scan.points.T, strict=True):
            table[axis] = column
        header = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(table)}\n"
            + "".join(f"property float {axis}\n" for axis in "xyz")
            + "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
            + "end_header\n"
        )
        with (folder / f"{scan.name}.ply").open("wb") as file:
            file.write(header.encode())
            table.tofile(file)
    poses = {f"{name}.ply": pose.tolist() for name, pose in (found.poses or {}).items()}
    (folder / "poses.json").write_text(json.dumps(poses))


def register(python: str, folder: Path, run: Path) -> tuple[float, float, int]:
    """Seconds, peak memory (MB) and scans placed of one run."""
    before = time.perf_counter()
    child = subprocess.Popen(
        [python, "-m", "mvreg", "dataset=folder", f"dataset.path={folder}",
         "dataset.pattern=*.ply", "dataset.ground_truth=poses.json", "rerun=false",
         f"hydra.run.dir={run}"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder,
    )  # fmt: skip
    _, _, usage = os.wait4(child.pid, 0)
    spent = time.perf_counter() - before
    report = json.loads((run / "result.json").read_text())
    return spent, usage.ru_maxrss / 1024, len(report["poses"])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scans", type=int, default=10)
    parser.add_argument("--points", type=int, default=5_000_000)
    parser.add_argument("--beside", help="the interpreter of another build")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "scans"
        # Elsewhere: the processes started here are born with this one's memory.
        writer = get_context("spawn").Process(
            target=write, args=(folder, arguments.scans, arguments.points)
        )
        writer.start()
        writer.join()
        table = Table("build", "placed", "s", "peak, MB", "bytes a point")
        pythons = [sys.executable, *([arguments.beside] if arguments.beside else [])]
        for number, python in enumerate(pythons):
            spent, peak, placed = register(python, folder, Path(temporary) / f"run_{number}")
            each = peak * 2**20 / (arguments.scans * arguments.points)
            table.add_row(python, str(placed), f"{spent:.1f}", f"{peak:.0f}", f"{each:.0f}")
    Console().print(table)


if __name__ == "__main__":
    main()
