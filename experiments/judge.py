"""Calibrate the judges: register all ordered pairs of scans, and see what tells right from wrong.

    python experiments/judge.py bunny dragon

A pair is right if its rotation is within 5 degrees of the truth. For each measure the table gives
the values that right pairs stay below and wrong pairs stay above, in units of the resolution of the
down-sampled scans (squared for the trimmed MSE).
"""

from __future__ import annotations

import sys
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

import mvreg
from mvreg import se3
from mvreg.stages.judge import surface_fit
from mvreg.types import Array

MEASURES = ("trimmed MSE", "point-to-plane RMS", "mean cosine", "overlap")


def measure(name: str) -> tuple[Array, NDArray[np.bool_]]:
    """Measures (P, 4) of all ordered pairs of a data set, and which pairs are right (P,)."""
    scanset = mvreg.dataset(name)
    if scanset.poses is None:
        raise mvreg.InputError(f"{name} has no ground truth")
    pipeline = mvreg.load_method("fcpma").pipeline
    rng = np.random.default_rng(0)
    views = pipeline.prepare(scanset.scans, rng)
    rows, right = [], []
    pairs = list(permutations(views, 2))
    for (source, target), own_rng in track(
        list(zip(pairs, rng.spawn(len(pairs)), strict=True)), description=name
    ):
        registration, _ = pipeline.register(source, target, [], own_rng)
        if registration is None:
            continue
        truth = se3.invert(scanset.poses[target.name]) @ scanset.poses[source.name]
        angle = se3.rotation_angle(truth, registration.T_target_source)
        residual, agreement = surface_fit(registration, source, target)
        mse = registration.trimmed_mse / source.scale.resolution**2
        rows.append([mse, residual, agreement, registration.overlap])
        right.append(np.rad2deg(angle) < 5)
    return np.array(rows), np.array(right)


def main(names: list[str]) -> None:
    """Print a table per data set."""
    for name in names:
        rows, right = measure(name)
        title = f"{name}: {right.sum()} right pairs, {(~right).sum()} wrong ones"
        table = Table("measure", "right: median", "90 %", "wrong: best", "5 %", "AUC", title=title)
        for column, label in enumerate(MEASURES):
            sign = -1 if label in ("mean cosine", "overlap") else 1
            good, bad = sign * rows[right][:, column], sign * rows[~right][:, column]
            area = (good[:, None] < bad[None]).mean()
            values = [*np.percentile(good, [50, 90]), bad.min(), np.percentile(bad, 5)]
            table.add_row(label, *(f"{sign * value:.3f}" for value in values), f"{area:.3f}")
        Console().print(table)


if __name__ == "__main__":
    main(sys.argv[1:] or ["bunny"])
