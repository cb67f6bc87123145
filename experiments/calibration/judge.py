"""Calibrate the judges: register all ordered pairs of scans, and separate right from wrong.

    python -m experiments.calibration.judge bunny dragon

For each measure the table gives the values that right pairs stay below and wrong pairs stay above,
in units of the resolution of the down-sampled scans (squared for the trimmed MSE). The pairs are
those of `roc`, which draws what this prints: registered once, and kept.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from experiments.calibration.raw_pairs import RawPair, cached
from experiments.calibration.roc import area
from experiments.common.runs import ROOT

#: What is measured: the column's name, the field, and 1 if small is good.
MEASURES = (
    ("trimmed MSE", "trimmed_mse", 1), ("point-to-plane RMS", "residual", 1),
    ("mean cosine", "agreement", -1), ("overlap", "overlap", -1),
)  # fmt: skip


def table(name: str, pairs: Sequence[RawPair]) -> Table:
    """One row per measure."""
    right = np.array([pair.right for pair in pairs])
    title = f"{name}: {right.sum()} right pairs, {(~right).sum()} wrong ones"
    made = Table("measure", "right: median", "90 %", "wrong: best", "5 %", "AUC", title=title)
    for label, field, sign in MEASURES:
        scores = sign * np.array([getattr(pair, field) for pair in pairs])
        good, bad = scores[right], scores[~right]
        values = [*np.percentile(good, [50, 90]), bad.min(), np.percentile(bad, 5)]
        numbers = [f"{sign * value:.3f}" for value in values]
        made.add_row(label, *numbers, f"{area(scores, right):.3f}")
    return made


def main(names: Sequence[str]) -> None:
    """Print a table per data set."""
    for name, pairs in cached(names, ROOT / "roc"):
        Console().print(table(name, pairs))


if __name__ == "__main__":
    main(sys.argv[1:] or ["bunny"])
