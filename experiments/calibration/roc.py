"""ROC curves of the measures that a judge can use, over all ordered pairs of raw scans.

    python -m experiments.calibration.roc bunny dragon buddha

registers all ordered pairs of each set, which takes minutes a set and is kept in
``runs/experiments/roc/``, so that it goes on where it stopped and can be drawn again at once; to
measure a set anew, delete its file. The picture is ``experiments/results/tmse_roc.png``. What
counts as right is told in `raw_pairs`.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from experiments.calibration.raw_pairs import RawPair, cached, load
from experiments.common.runs import ROOT
from experiments.common.style import absent, canvas, save, styled
from mvreg.errors import InputError
from mvreg.stages.judge.residual import PointToPlaneJudge, TmseSurfaceJudge
from mvreg.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILE = Path(__file__).parents[1] / "results" / "tmse_roc.png"
SETS = ("bunny", "dragon", "buddha")
Flags = NDArray[np.bool_]

#: What is measured: the field, 1 if small is good, the legend, colour and line.
SCORES = (
    ("residual", 1, "point-to-plane", "#0072B2", "-"),
    ("tmse_ratio", 1, "TMSE, Eq. (7)", "#D55E00", "--"),
    ("agreement", -1, "agreement", "#009E73", "-."),
    ("overlap", -1, "overlap", "#7F7F7F", ":"),
)
#: The thresholds in use: the judge, its mark, colour, size and legend.
MARKS = (
    ("residual", "o", "#0072B2", 9, "point-to-plane within 0.5"),
    ("tmse", "s", "#D55E00", 7, "TMSE within Eq. (7)"),
    ("both", "*", "black", 6, "FCPMA's judge"),
)


def curve(scores: Array, right: Flags) -> tuple[Array, Array]:
    """The receiver operating characteristic of a score of which small values mean right.

    Parameters
    ----------
    scores : (P,) array
    right : (P,) array of bool
        With at least one pair of each kind.

    Returns
    -------
    wrong_accepted, right_accepted : (T,) arrays
        Shares, from (0, 0) to (1, 1); one step per value, so that ties are accepted together.
    """
    order = np.argsort(scores, kind="stable")
    last = np.flatnonzero(np.diff(scores[order], append=np.inf) > 0)
    truth = np.asarray(right, dtype=bool)[order]
    shares = [np.cumsum(kind)[last] / kind.sum() for kind in (~truth, truth)]
    return np.append(0.0, shares[0]), np.append(0.0, shares[1])


def area(scores: Array, right: Flags) -> float:
    """The area under the curve: how often a right pair scores below a wrong one, ties by half."""
    across, up = curve(scores, right)
    return float(np.trapezoid(up, across))


def accepted(pairs: Sequence[RawPair], judge: str) -> Flags:
    """Which pairs (P,) a judge with its defaults accepts: "tmse", "residual" or "both"."""
    judge_both = TmseSurfaceJudge()
    tmse = np.array([pair.tmse_ratio <= 1 for pair in pairs], dtype=bool)
    residual = np.array([p.residual <= PointToPlaneJudge().max_residual for p in pairs], dtype=bool)
    localizable = [
        p.agreement >= judge_both.min_agreement
        and p.localizability >= judge_both.min_localizability
        for p in pairs
    ]
    surface = residual & np.array(localizable, dtype=bool)
    known: dict[str, Flags] = {"tmse": tmse, "residual": residual, "both": tmse & surface}
    return known[judge]


def draw_roc(sets: Mapping[str, Sequence[RawPair]]) -> Figure:
    """A column per data set: a curve per score, the thresholds in use, the corner enlarged."""
    figure = canvas(5.6)
    columns = zip(*figure.subplots(2, len(sets), squeeze=False), strict=True)
    for (top, below), (name, pairs) in zip(columns, sets.items(), strict=True):
        right = np.array([pair.right for pair in pairs], dtype=bool)
        if not right.any() or right.all():
            absent(top, "not run", name)
            absent(below, "")
            continue
        lines, marks = panel(top, pairs, right)
        panel(below, pairs, right)
        top.set(title=f"{name}: {right.sum()} right, {(~right).sum()} wrong",
                xlim=(-0.01, 1), ylim=(0, 1.01))  # fmt: skip
        below.legend(
            handles=lines,
            loc="lower right",
            fontsize=8,
            frameon=True,
            framealpha=0.9,
            edgecolor="white",
        )
        below.set(xlim=(-0.002, 0.2), ylim=(0.7, 1.003))
        figure.legends = []  # the same for all
        figure.legend(handles=marks, loc="upper center", ncols=len(marks))
    figure.supxlabel("wrong pairs accepted (share); below, the corner enlarged", fontsize=8.5)
    figure.supylabel("right pairs accepted (share)", fontsize=8.5, x=0.008)
    figure.subplots_adjust(left=0.075, right=0.98, bottom=0.09, top=0.88, wspace=0.2, hspace=0.16)
    return figure


def panel(axis: Any, pairs: Sequence[RawPair], right: Flags) -> tuple[list[Any], list[Any]]:
    """Draw the curves and the marks of one data set; returns both, for legends."""
    curves, marks = [], []
    for field, sign, label, colour, line in SCORES:
        scores = sign * np.array([getattr(pair, field) for pair in pairs])
        legend = f"{label}: AUC {area(scores, right):.3f}"
        curves += axis.plot(*curve(scores, right), line, color=colour, label=legend)
    how: dict[str, Any] = {"linestyle": "", "markeredgewidth": 1.4, "zorder": 4}
    for judge, marker, colour, size, label in MARKS:
        taken = accepted(pairs, judge)
        at = taken[~right].mean(), taken[right].mean()
        how |= {"marker": marker, "color": colour, "markersize": size, "label": label}
        marks += axis.plot(*at, markerfacecolor="black" if judge == "both" else "none", **how)
    return curves, marks


def draw(folder: Path, file: Path) -> Path | None:
    """Draw what has been registered; None where nothing has."""
    sets = {n: load(folder / f"{n}.json") if (folder / f"{n}.json").is_file() else [] for n in SETS}
    if not any(sets.values()):
        return None
    with styled():
        return save(draw_roc(sets), file, 64)


def main(names: Sequence[str]) -> None:
    """Register what has not been, then draw."""
    unknown = set(names) - set(SETS)
    if unknown:
        raise SystemExit(f"expected data sets out of {', '.join(SETS)}; got {', '.join(unknown)}")
    try:
        for name, pairs in cached(names, ROOT / "roc"):
            print(f"{name}: {sum(p.right for p in pairs)} right of {len(pairs)} registrations")
    except InputError as error:
        Console(stderr=True).print(f"error: {error}", style="red", highlight=False)
    drawn = draw(ROOT / "roc", FILE)
    print(f"written to {drawn}" if drawn else "nothing to draw")


if __name__ == "__main__":
    main(sys.argv[1:] or SETS)
