"""Save the poses that methods find, or compare them with saved ones, bit for bit.

    python -m experiments.accuracy.poses write before.npz     # with the code as it was
    python -m experiments.accuracy.poses compare before.npz   # with the code as it is

For changes that must not affect results. The file has one array per data set, method and scan.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import mvreg
from mvreg.types import Array

METHODS = ("auto", "fcpma", "ocpma", "ocpra", "surfc", "spant")
DATASETS = ("tiny", "figurine", "bunny", "dragon", "buddha")


def found(dataset: str, method: str) -> dict[str, Array]:
    """Poses ``T_model_scan`` (4, 4) by scan; those of other components by ``component N/scan``."""
    result = mvreg.register(mvreg.dataset(dataset), method)
    poses = dict(result.poses)
    for number, component in enumerate(result.components, start=2):
        poses |= {f"component {number}/{name}": pose for name, pose in component.items()}
    return poses


def each(datasets: list[str], methods: list[str]) -> Iterator[tuple[str, dict[str, Array]]]:
    """Every run asked for, under ``dataset/method``."""
    for dataset in datasets:
        for method in methods:
            start = time.perf_counter()
            poses = found(dataset, method)
            print(f"{dataset}/{method}: {len(poses)} poses in {time.perf_counter() - start:.1f} s")
            yield f"{dataset}/{method}", poses


def difference(before: dict[str, Array], after: dict[str, Array]) -> str:
    """Describe the difference; empty if all poses are bitwise equal."""
    if before.keys() != after.keys():
        lost, new = sorted(before.keys() - after.keys()), sorted(after.keys() - before.keys())
        return f"placed no more: {', '.join(lost) or 'none'}; newly: {', '.join(new) or 'none'}"
    if all(np.array_equal(before[name], after[name]) for name in before):
        return ""
    largest = max(float(np.abs(before[name] - after[name]).max()) for name in before)
    return f"largest difference of an entry {largest:.3g}"


def main() -> int:
    """Write or compare; exit code 1 on any difference."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("action", choices=["write", "compare"])
    parser.add_argument("file", type=Path)
    parser.add_argument("--datasets", nargs="+", default=list(DATASETS))
    parser.add_argument("--methods", nargs="+", default=list(METHODS))
    asked = parser.parse_args()
    runs = each(asked.datasets, asked.methods)
    if asked.action == "write":
        kept = {f"{run}/{name}": pose for run, poses in runs for name, pose in poses.items()}
        np.savez(asked.file, allow_pickle=False, **kept)
        return 0
    kept = dict(np.load(asked.file))
    changed = 0
    for run, poses in runs:
        before = {k.removeprefix(f"{run}/"): v for k, v in kept.items() if k.startswith(f"{run}/")}
        said = difference(before, poses)
        print(f"  {said or 'the same, bit for bit'}")
        changed += bool(said)
    return int(bool(changed))


if __name__ == "__main__":
    sys.exit(main())
