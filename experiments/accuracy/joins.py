"""How sure the judge is where the default method joins two partial models of several scans.

    python -m experiments.accuracy.joins bunny dragon buddha --orders 8

Such a join carries several scans at once. Registers each set in several random orders, every scan
moved at random, and lists the confidence of each accepted pair that joined two partial models of
two scans or more each, and whether its pose is right: what `CERTAIN` in
``mvreg/stages/strategy/best_first/loop_closure.py`` was chosen by.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping

import numpy as np
from rich.console import Console
from rich.progress import track

import mvreg
from mvreg.geometry import se3
from mvreg.stages.strategy.best_first.loop_closure import CERTAIN
from mvreg.types import Array, Pair, Result

#: A pose is right within so many degrees of the data set's own.
RIGHT = 5.0


def joins(result: Result) -> Iterator[Pair]:
    """The accepted pairs that joined two partial models of two scans or more."""
    group: dict[str, set[str]] = {}
    for pair in result.pairs:
        if not pair.verdict.reliable:
            continue
        first = group.setdefault(pair.source, {pair.source})
        second = group.setdefault(pair.target, {pair.target})
        if first is second:
            continue
        if min(len(first), len(second)) > 1:
            yield pair
        first |= second
        for name in second:
            group[name] = first


def is_right(pair: Pair, poses: Mapping[str, Array]) -> bool:
    """Whether the pose of a pair is about that of the ground truth ``T_world_scan``."""
    truth = se3.invert(poses[pair.target]) @ poses[pair.source]
    assert pair.T_target_source is not None
    return bool(np.rad2deg(se3.rotation_angle(truth, pair.T_target_source)) < RIGHT)


def main() -> None:
    """Print a line for each data set, and the least sure joins."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("datasets", nargs="+")
    parser.add_argument("--orders", type=int, default=8)
    asked = parser.parse_args()
    console = Console()
    for name in asked.datasets:
        found: list[tuple[float, bool]] = []
        for rng in track(range(asked.orders), description=name):
            scans = mvreg.dataset(name, rng=rng, order="shuffle", scramble=True)
            result = mvreg.register(scans, rng=rng)
            for pair in joins(result):
                found.append((pair.verdict.confidence or 0.0, is_right(pair, scans.poses or {})))
        found.sort()
        doubted = sum(confidence < CERTAIN for confidence, _ in found)
        wrong = [round(confidence, 4) for confidence, right in found if not right]
        console.print(
            f"{name}: {len(found)} joins in {asked.orders} orders, {doubted} less than nearly "
            f"certain; wrong: {wrong or 'none'}; least confidence {found[0][0]:.4f}"
        )


if __name__ == "__main__":
    main()
