"""Time and peak memory of a folder of large scans, beside another build of mvreg.

    python -m experiments.bench.large --points 5000000 --beside ../before/.venv/bin/python
    python -m experiments.bench.large --format laz --source ../before

Writes ten scans of the figurine with colours, as binary PLY in single precision as scanners do, or
as LAZ, whose folder laspy alone reads, too. Reads and registers the folder with each build in turn.
Peak memory is the largest resident set of the process (`VmHWM`), read by the kernel's accounting of
children.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from mvreg.types import Array

COLOURS = ("red", "green", "blue")
#: Reads a folder, and nothing else.
READ = (
    "import sys; from mvreg.config.compose import compose; from mvreg.run import load_scans; "
    "load_scans(compose(['dataset=folder', f'dataset.path={sys.argv[1]}', "
    "f'dataset.pattern=*.{sys.argv[2]}']), 0)"
)
LASPY = (
    "import sys, laspy; from pathlib import Path\n"
    "for path in sorted(Path(sys.argv[1]).glob('*.' + sys.argv[2])): laspy.read(path)"
)


def write(folder: Path, scans: int, points: int, format: str) -> None:
    """The scans, and their true poses."""
    import mvreg

    folder.mkdir(parents=True, exist_ok=True)
    found = mvreg.dataset("figurine", views=scans, points=points, scramble=True)
    for scan in found.scans:
        writer = write_laz if format == "laz" else write_ply
        writer(folder / f"{scan.name}.{format}", scan.points)
    poses = {f"{name}.{format}": pose.tolist() for name, pose in (found.poses or {}).items()}
    (folder / "poses.json").write_text(json.dumps(poses))


def write_ply(path: Path, points: Array) -> None:
    """Points with black colours, in single precision."""
    kinds = [(axis, "<f4") for axis in "xyz"] + [(colour, "u1") for colour in COLOURS]
    table = np.zeros(len(points), dtype=kinds)
    for axis, column in zip("xyz", points.T, strict=True):
        table[axis] = column
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(table)}\n"
        + "".join(f"property float {axis}\n" for axis in "xyz")
        + "".join(f"property uchar {colour}\n" for colour in COLOURS)
        + "end_header\n"
    )
    with path.open("wb") as file:
        file.write(header.encode())
        table.tofile(file)


def write_laz(path: Path, points: Array) -> None:
    """Points to a thousandth, with intensities and colours that are not the same everywhere."""
    import laspy

    header = laspy.LasHeader(point_format=7, version="1.4")
    header.scales = np.full(3, 1e-3)
    data = laspy.LasData(header)
    data.x, data.y, data.z = points.T
    for k, name in enumerate(("intensity", *COLOURS)):
        data[name] = (np.abs(points[:, k % 3]) * 97).astype(np.uint16)
    data.write(str(path))


def measured(command: Sequence[str], folder: Path, source: str | None) -> tuple[float, float]:
    """Seconds and peak memory (MB) of a process."""
    before = time.perf_counter()
    environment = os.environ | ({"PYTHONPATH": source} if source else {})
    child = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder, env=environment
    )
    _, status, usage = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"failed: {' '.join(command)}")
    return time.perf_counter() - before, usage.ru_maxrss / 1024


def registered(
    python: str, folder: Path, format: str, run: Path, source: str | None
) -> tuple[float, float, int]:
    """Seconds, peak memory (MB) and scans placed of one run."""
    spent, peak = measured(
        [python, "-m", "mvreg", "dataset=folder", f"dataset.path={folder}",
         f"dataset.pattern=*.{format}", "dataset.ground_truth=poses.json", "rerun=false",
         f"hydra.run.dir={run}"], folder, source,
    )  # fmt: skip
    return spent, peak, len(json.loads((run / "result.json").read_text())["poses"])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scans", type=int, default=10)
    parser.add_argument("--points", type=int, default=5_000_000)
    parser.add_argument("--format", choices=("ply", "laz"), default="ply")
    parser.add_argument("--beside", help="the interpreter of another build")
    parser.add_argument("--source", help="the folder of another build with the same compiled parts")
    parser.add_argument("--rounds", type=int, default=1, help="each in turn so often")
    arguments = parser.parse_args()
    format, total = arguments.format, arguments.scans * arguments.points
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "scans"
        # Elsewhere: the processes started here are born with this one's memory.
        writer = get_context("spawn").Process(
            target=write, args=(folder, arguments.scans, arguments.points, format)
        )
        writer.start()
        writer.join()
        table = Table("build", "what", "placed", "s", "peak, MB", "bytes a point")

        def add(build: str, what: str, spent: float, peak: float, placed: object = "") -> None:
            each = f"{peak * 2**20 / total:.0f}"
            table.add_row(build, what, str(placed), f"{spent:.1f}", f"{peak:.0f}", each)

        builds: list[tuple[str, str | None]] = [(sys.executable, None)]
        if arguments.beside:
            builds.append((arguments.beside, None))
        if arguments.source:
            builds.append((sys.executable, str(Path(arguments.source).absolute())))
        for number in range(arguments.rounds):
            if format == "laz":
                command = [sys.executable, "-c", LASPY, str(folder), format]
                add("laspy", "read", *measured(command, folder, None))
            for k, (python, source) in enumerate(builds):
                command = [python, "-c", READ, str(folder), format]
                add(
                    Path(source).name if source else python,
                    "read",
                    *measured(command, folder, source),
                )
                run = Path(temporary) / f"run_{number}_{k}"
                spent, peak, placed = registered(python, folder, format, run, source)
                add(Path(source).name if source else python, "registered", spent, peak, placed)
    Console().print(table)


if __name__ == "__main__":
    main()
