"""One timed run in its own process, started by the benchmarks.

    python -m experiments.bench.child '{"method": "fcpma", "dataset": "bunny"}' answer.json

Imports and loading are over before the clock of the registration starts; loading is the reading of
scans, once the configuration is composed. Whatever libraries print, the answer goes to a file.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mvreg.types import Result, ScanSet

#: Imported by some stage only when it is called.
IMPORTS = (
    "mvreg", "mvreg.run", "mvreg.evaluation.pose_errors", "scipy.spatial", "scipy.sparse.linalg",
    "scipy.sparse.csgraph", "scipy.optimize",
)  # fmt: skip
#: What a peer needs besides.
PEERS: Mapping[str, Sequence[str]] = {
    "open3d_multiway": ("mvreg_peers.open3d_multiway", "open3d"),
    "kiss_gicp": ("mvreg_peers.kiss_gicp", "kiss_matcher", "small_gicp"),
}
#: The stages of a run, in order. A peer brings its own.
STAGES = ("downsample", "describe", "seed", "propagate", "refine", "judge", "augment", "adjust")
#: A scan further from its truth than this (degrees) is a false positive.
FALSE = 5.0


def main(spec: Mapping[str, Any], file: Path) -> None:
    """Run what `spec` asks for, and write what was measured."""
    start = time.perf_counter()
    imported(str(spec["method"]))
    imports, source = time.perf_counter() - start, source_of(spec)
    start = time.perf_counter()
    scanset = source()
    loading, held = time.perf_counter() - start, resident()
    answer = registered(spec, scanset)
    answer |= {"imports": imports, "load": loading, "held_mb": held, "peak_mb": peak()}
    file.write_text(json.dumps(answer), "utf-8")


def imported(method: str) -> None:
    """Import whatever the method will ask for; a peer that is missing says so itself, later."""
    from experiments.bench.free import plain
    from mvreg import load_open3d

    for name in (*IMPORTS, *PEERS.get(plain(method), ())):
        try:
            load_open3d() if name == "open3d" else import_module(name)
        except ImportError:
            continue


def source_of(spec: Mapping[str, Any]) -> Callable[[], ScanSet]:
    """What reads the scans: of a data set by its name, or of a column that is kept in a folder."""
    import numpy as np

    from experiments.bench.column import Column
    from mvreg.config.compose import compose, stage_from
    from mvreg.config.overrides import overrides_from

    rng, more = np.random.default_rng(int(spec.get("rng", 0))), dict(spec.get("parameters", {}))
    if spec["dataset"] == "column":
        return partial(Column(**more), rng)
    changes = {f"dataset.{key}": value for key, value in more.items()}
    words = [f"dataset={spec['dataset']}", *overrides_from(changes)]
    return partial(stage_from(compose(words), "dataset"), rng)


def registered(spec: Mapping[str, Any], scanset: ScanSet) -> dict[str, Any]:
    """Register the scans and time it."""
    import numpy as np

    from experiments.bench.free import changes, let_loose, plain
    from mvreg.events import ignore
    from mvreg.parallel import quick_turns
    from mvreg.report.build import pair_seconds
    from mvreg.run import load_method, run

    name, rng = str(spec["method"]), np.random.default_rng(int(spec.get("rng", 0)))
    let_loose(name)
    method = load_method(plain(name), changes(name))
    quick_turns()  # as the command line does
    known = set(sys.modules)
    result, _, seconds = run(scanset.scans, method, rng, ignore)
    late = sorted(set(sys.modules) - known)
    total = seconds.pop("total")
    stages = {**pair_seconds(result.pairs), **seconds}
    if plain(name) in PEERS:  # they work on the raw scans: this was for the evaluation
        total -= stages.pop("downsample", 0.0) + stages.pop("describe", 0.0)
    stages["other"] = total - sum(stages.values())
    points = sum(len(scan.points) for scan in scanset.scans)
    found = {"seconds": total, "stages": stages, "late_imports": late, "points": points}
    return found | outcome(result, scanset)


def outcome(result: Result, scanset: ScanSet) -> dict[str, Any]:
    """The number of scans placed, and their errors against ground truth."""
    from mvreg.evaluation.pose_errors import result_errors

    errors, apart = result_errors(result, scanset)
    each = [error for part in (errors, *apart) if part for error in part.scans.values()]
    mean = None if errors is None else errors.mean
    return {
        "scans": len(scanset.scans),
        "placed": len(result.poses),
        "parts": [len(part) for part in result.components],
        "false": None if mean is None else sum(error.angle > FALSE for error in each),
        "pairs": len(result.pairs),
        "rotation": None if mean is None else mean.rotation,
        "translation": None if mean is None else mean.translation,
    }


def peak() -> float:
    """The peak resident memory of this process (MB).

    Linux hands the figure of `getrusage` down from the process that started this one, so that its
    own account is asked first.
    """
    own = status("VmHWM")
    if own is not None:
        return own
    unit = 1e6 if sys.platform == "darwin" else 1e3  # bytes there, kilobytes elsewhere
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


def resident() -> float | None:
    """The current resident memory of this process (MB), None where it cannot be read."""
    return status("VmRSS")


def status(key: str) -> float | None:
    """A figure of Linux's account of this process (MB), None elsewhere."""
    file = Path("/proc/self/status")
    if not file.is_file():
        return None
    lines = [line for line in file.read_text("utf-8").splitlines() if line.startswith(f"{key}:")]
    return int(lines[0].split()[1]) * 1024 / 1e6 if lines else None


if __name__ == "__main__":
    main(json.loads(sys.argv[1]), Path(sys.argv[2]))
