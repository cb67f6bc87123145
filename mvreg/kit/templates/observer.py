"""An observer of runs: it leaves ``nameless.csv`` in every run folder."""

from __future__ import annotations

import csv
from pathlib import Path

from mvreg.events import Event, PairRegistered, RunFinished, RunStarted
from mvreg.geometry import se3

#: Of the table that is written.
COLUMNS = ("scan", "placed", "x", "y", "z", "qx", "qy", "qz", "qw", "attempts")


class NamelessObserver:
    """Counts the attempts of each scan, and writes them with the poses when the run has ended.

    Poses are ``T_model_scan``: a position in the unit of the scans, and a unit quaternion. What
    only wants the poses of runs, for another program, does without the counting.
    """

    def __init__(self) -> None:
        self.folder: Path | None = None
        self.attempts: dict[str, int] = {}

    def mvreg_event(self, event: Event) -> None:
        """Take note of one event; runs of a library call have no folder, and leave nothing."""
        match event:
            case RunStarted():
                self.folder, self.attempts = event.folder, {}
            case PairRegistered():
                name = event.source.name
                self.attempts[name] = self.attempts.get(name, 0) + 1
            case RunFinished() if self.folder is not None:
                self.write(event, self.folder / "nameless.csv")

    def write(self, event: RunFinished, file: Path) -> None:
        """Write a row per scan; those that are not placed have no pose."""
        with file.open("w", newline="", encoding="utf-8") as stream:
            table = csv.writer(stream)
            table.writerow(COLUMNS)
            for scan in event.scanset.scans:
                pose = event.result.poses.get(scan.name)
                numbers = ["" for _ in range(7)] if pose is None else [
                    *map(repr, pose[:3, 3].tolist()),
                    *map(repr, se3.quaternion(pose[:3, :3]).tolist()),
                ]  # fmt: skip
                attempts = self.attempts.get(scan.name, 0)
                table.writerow([scan.name, pose is not None, *numbers, attempts])
