"""Figs. 7 and 8: how many pair-wise registrations, and how long, per data set and method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from experiments.common.style import GREY, LABELS, METHODS, canvas
from experiments.report.measured import Measured

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Share of a group's width that its bars take.
FULL = 0.8
#: How it is written why a bar is missing: before the lines across.
WORD: Any = {
    "ha": "center", "va": "bottom", "color": GREY, "fontsize": 8, "zorder": 4,
    "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 1.0},
}  # fmt: skip

Groups = Mapping[str, Mapping[str, Measured]]


def draw_bars(groups: Groups, scans: Mapping[str, int]) -> Figure:
    """Two panels of grouped bars.

    Parameters
    ----------
    groups : mapping of data set to mapping of method to Measured
        All data sets have the same methods, in the same order.
    scans : mapping of data set to int
        N, for the fewest registrations that could do and all there are, N - 1 and N (N - 1) / 2.
    """
    figure = canvas(3.3)
    left, right = figure.subplots(1, 2)
    bars(left, groups, "pairs")
    bars(right, groups, "seconds")
    marks(left, [scans[name] for name in groups])
    left.set_ylabel("pair-wise registrations")
    right.set_ylabel("run time (s)")
    handles, labels = left.get_legend_handles_labels()
    lines = len(labels) - len(next(iter(groups.values())))  # they come first
    figure.legend(
        handles[lines:] + handles[:lines], labels[lines:] + labels[:lines], loc="upper center",
        ncols=len(labels),
    )  # fmt: skip
    if any(m.placed and not m.complete for row in groups.values() for m in row.values()):
        figure.text(0.99, 0.955, "*: not all placed", ha="right", fontsize=8, color=GREY)
    figure.subplots_adjust(left=0.065, right=0.99, bottom=0.09, top=0.89, wspace=0.17)
    return figure


def bars(axis: Any, groups: Groups, quantity: str) -> None:
    """One panel: a group per data set, a bar per method, its value or why there is none above."""
    methods = list(next(iter(groups.values())))
    width = FULL / len(methods)
    values = {name: [getattr(m, quantity) for m in row.values()] for name, row in groups.items()}
    highest = max([v for row in values.values() for v in row if math.isfinite(v)], default=1.0)
    for order, method in enumerate(methods):
        across = [at + (order - (len(methods) - 1) / 2) * width for at in range(len(groups))]
        heights = [row[order] for row in values.values()]
        shown = [0.0 if math.isnan(height) else height for height in heights]
        axis.bar(across, shown, 0.9 * width, color=METHODS[method], label=LABELS[method])
        for at, height, group in zip(across, heights, groups.values(), strict=True):
            if not math.isnan(height):
                star = "" if group[method].complete else "*"
                axis.text(at, height + 0.01 * highest, f"{height:.0f}{star}", ha="center",
                          va="bottom", fontsize=8)  # fmt: skip
            elif not same_word(group):
                axis.text(at, 0.02 * highest, group[method].word, rotation=90, **WORD)
    for at, group in enumerate(groups.values()):
        if word := same_word(group):
            axis.text(at, 0.3 * highest, word.replace(" this", "\nthis"), **WORD)
    axis.set_xticks(range(len(groups)), list(groups))
    axis.tick_params(axis="x", length=0)
    axis.set_xlim(-0.5, len(groups) - 0.5)
    axis.margins(y=0.08)


def same_word(group: Mapping[str, Measured]) -> str:
    """Why the whole group is empty, where it is for one reason."""
    words = {each.word for each in group.values()}
    return words.pop() if len(words) == 1 else ""


def marks(axis: Any, scans: Sequence[int]) -> None:
    """Lines across each group at N - 1 and at N (N - 1) / 2."""
    half = FULL / 2 + 0.04
    for count, style, label in (
        ([n - 1 for n in scans], "-", "N − 1"),  # noqa: RUF001 the sign, not a hyphen
        ([n * (n - 1) // 2 for n in scans], "--", "N (N − 1) / 2"),  # noqa: RUF001
    ):
        starts = [at - half for at in range(len(scans))]
        ends = [at + half for at in range(len(scans))]
        axis.hlines(count, starts, ends, "black", style, linewidth=1.0, label=label, zorder=3)
    axis.set_ylim(0, 1.12 * max(n * (n - 1) // 2 for n in scans))
