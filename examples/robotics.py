"""A stream of scans in, poses out: what a robot, or an arm with a camera, does as it goes.

Each new scan is registered to the last few that have a pose, which keep theirs, within a time. A
scan that fits none of them yet waits, and is tried again with the next: no initial guess is needed.

    python examples/robotics.py --dataset tiny
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

import mvreg
from mvreg.types import Array, PointLike, Scan


@dataclass
class Mapper:
    """A map on its way.

    Parameters
    ----------
    window : int
        A new scan is registered to so many of those placed last.
    seconds : float
        How long that may take; what is placed by then counts.
    store : Path, optional
        Where finished work is kept: a scan that comes again, or waits, is not prepared twice.
    """

    window: int = 4
    seconds: float = 30.0
    store: Path | None = None
    placed: dict[str, Scan] = field(default_factory=dict)
    waiting: dict[str, Scan] = field(default_factory=dict)

    def add(self, name: str, points: PointLike) -> dict[str, Array]:
        """Take a scan (N, 3) in; return the poses ``T_map_scan`` (4, 4) that are new.

        The first scan's frame is the map's. The answer is empty where the scan fits nothing yet,
        and has several poses where others had waited for it.
        """
        self.waiting[name] = Scan(name, points)
        if not self.placed:
            return self.place({name: np.eye(4)})
        last = list(self.placed.values())[-self.window :]
        deadline = time.monotonic() + self.seconds
        try:
            result = mvreg.register(
                [*last, *self.waiting.values()],
                store=self.store or False,
                progress=lambda now: time.monotonic() < deadline,
            )
        except mvreg.CancelledError as late:
            if late.result is None:
                return {}
            result = late.result
        for poses in (result.poses, *result.components):
            if last[0].name in poses:
                return self.place(poses)
        return {}

    def place(self, poses: Mapping[str, Array]) -> dict[str, Array]:
        """Let those that waited have their poses, and hold them fast."""
        new = {name: pose for name, pose in poses.items() if name in self.waiting}
        for name, pose in new.items():
            self.placed[name] = replace(self.waiting.pop(name), initial=pose, fixed=True)
        return new


def follow(stream: Iterable[Scan], mapper: Mapper) -> dict[str, Array]:
    """Map a stream of scans, and say how it goes; all poses."""
    for scan in stream:
        started = time.perf_counter()
        new = mapper.add(scan.name, scan.points)
        took = time.perf_counter() - started
        what = ", ".join(new) if new else "waits"
        print(f"{scan.name}: {what}; {len(mapper.placed)} in the map, {took:.1f} s")
    found = {name: scan.initial for name, scan in mapper.placed.items()}
    return {name: pose for name, pose in found.items() if pose is not None}


def main(words: list[str] | None = None) -> int:
    """Play a data set as if it came from a sensor."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--dataset", default="tiny")
    parser.add_argument("--window", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=30.0)
    asked = parser.parse_args(words)
    scans = mvreg.dataset(asked.dataset)
    poses = follow(scans.scans, Mapper(asked.window, asked.seconds))
    first = scans.scans[0].name
    errors = mvreg.pose_errors(poses, scans.poses, first)
    if errors is not None:
        most = errors.max
        print(f"largest errors: {most.angle:.2f} degrees, {most.translation:.2f} {scans.unit}")
    return 0 if len(poses) == len(scans.scans) else 3


if __name__ == "__main__":
    sys.exit(main())
