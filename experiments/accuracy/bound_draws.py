"""Draws of the noise limit on disk: a run goes on where the last one ended."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.accuracy.bound_page import Measured
from mvreg.report.run_folder import write_text
from mvreg.types import Array

#: Squared errors of six unknowns within this are within the 95 per cent ellipsoid (chi-square).
INSIDE = 12.592


@dataclass(frozen=True, eq=False)
class Draw:
    """One draw: bound, error, reported error (3,) in mm; squared errors (N - 1,) of poses."""

    lengths: Array
    squared: Array
    method: float | None
    peers: tuple[float, ...] = ()


@dataclass(frozen=True)
class Drawer:
    """Makes draws, or finds them in a `folder`: one file for each, whole or not there."""

    folder: Path
    make: Callable[[str, float, int, bool], Draw]

    def __call__(self, shape: str, noise: float, run: int, peers: bool) -> Draw:
        """A draw; made again if it was kept without the peers that are asked for now."""
        kept = self.kept(shape, noise, run)
        if kept is None or (peers and not kept.peers):
            kept = self.make(shape, noise, run, peers)
            self._keep(self._file(shape, noise, run), kept)
        return kept

    def kept(self, shape: str, noise: float, run: int) -> Draw | None:
        """A draw that is on disk; None if there is none."""
        file = self._file(shape, noise, run)
        if not file.exists():
            return None
        found = json.loads(file.read_text())
        return Draw(
            np.array(found["lengths"]), np.array(found["squared"]), found["method"],
            tuple(found["peers"]),
        )  # fmt: skip

    def _file(self, shape: str, noise: float, run: int) -> Path:
        return self.folder / f"{shape} {noise:g} {run}.json"

    def _keep(self, file: Path, made: Draw) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        row = {
            "lengths": made.lengths.tolist(), "squared": made.squared.tolist(),
            "method": made.method, "peers": list(made.peers),
        }  # fmt: skip
        write_text(file, json.dumps(row))


def summed_up(shape: str, noise: float, draws: Sequence[Draw]) -> Measured:
    """What draws of one case come to, the first of which has the method's answer.

    Raises
    ------
    ValueError
        If there are none.
    """
    if not draws:
        raise ValueError(f"{shape}, noise {noise:g}: expected at least one draw, got none")
    least, error, reported = np.sqrt(np.mean([np.square(d.lengths) for d in draws], axis=0))
    others = np.array([d.peers for d in draws if d.peers])
    squared = np.concatenate([draw.squared for draw in draws])
    return Measured(
        shape, noise, float(least), float(error), float(reported), float(squared.mean()),
        float((squared < INSIDE).mean()), draws[0].method,
        tuple(np.sqrt((others**2).mean(axis=0)).tolist()) if len(others) else (), len(draws),
    )  # fmt: skip
