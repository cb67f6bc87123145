"""Errors and number of pairs in each random order, with the targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from experiments.common.style import DATASETS, GREY, canvas
from experiments.report.goals import GOALS
from experiments.report.outcomes import Outcome, Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What is drawn, under which title, and the goal that it is to stay below.
PANELS = (
    ("rotation", "rotation error $e_R$"),
    ("translation", "translation error $e_t$ (mm)"),
    ("pairs", "pairs attempted / scans"),
)


def draw_orders(rows: Sequence[Row]) -> Figure:
    """A panel per quantity: a mark for each order, a line for the median, dashed for the goal.

    Parameters
    ----------
    rows : sequence of Row
        One for each data set, its name the first value; marks are hollow where not all the scans
        are placed right.
    """
    figure = canvas(2.9)
    axes = figure.subplots(1, len(PANELS))
    for axis, (name, title) in zip(axes, PANELS, strict=True):
        for row in rows:
            draw_row(axis, row, name)
        axis.set_title(title)
        axis.set_ylim(0)
        axis.set_xticks([])
    figure.supxlabel("random orders", fontsize=8.5, y=0.02)
    figure.text(0.99, 0.02, "solid: median; dashed: bar; hollow: not all right", ha="right",
                fontsize=8, color=GREY)  # fmt: skip
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncols=max(1, len(labels)))
    figure.subplots_adjust(left=0.055, right=0.99, bottom=0.12, top=0.78, wspace=0.25)
    return figure


def draw_row(axis: Any, row: Row, name: str) -> None:
    """One data set in one panel: a column of marks, one per order, sorted by value."""
    values = sorted(
        (value(each, name), each.complete) for each in row.known
        if math.isfinite(value(each, name))
    )  # fmt: skip
    if not values:
        return
    colour, marker = DATASETS.get(row.values[0], (GREY, "o"))
    place = list(GOALS).index(row.values[0]) if row.values[0] in GOALS else len(GOALS)
    step = 0.8 / len(values)
    spots = [place + step * (index + 0.5 - len(values) / 2) for index in range(len(values))]
    axis.plot(spots, [y for y, _ in values], marker, color=colour, label=row.values[0])
    for x, (y, complete) in zip(spots, values, strict=True):
        if not complete:
            axis.plot(x, y, marker, color=colour, markerfacecolor="white")
    ends = place - 0.45, place + 0.45
    axis.plot(ends, 2 * [row.median(lambda each: value(each, name))], color=colour, linewidth=1)
    if row.values[0] in GOALS:
        axis.plot(ends, 2 * [getattr(GOALS[row.values[0]], name)], "--", color=colour)


def value(outcome: Outcome, name: str) -> float:
    """A quantity of one run."""
    if name == "pairs":
        return outcome.pairs_per_scan
    return float(getattr(outcome.now, name))
