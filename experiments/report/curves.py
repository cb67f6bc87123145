"""Curves of the ablations: errors, registrations and time over one parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from experiments.common.style import DATASETS, GREY, canvas
from experiments.report.measured import Measured

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: What is drawn: the field of Measured, and the panel's title.
PANELS = (
    ("rotation", "rotation error $e_R$"), ("translation", "translation error $e_t$ (mm)"),
    ("pairs", "pair-wise registrations"), ("seconds", "run time (s)"),
)  # fmt: skip
#: For series that are not data sets; as `style.DATASETS`.
OTHERS = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#CC79A7", "D"))
#: A panel whose values spread by more than this factor has a logarithmic axis.
SPREAD = 30

Series = Mapping[str, Sequence[tuple[float, Measured]]]


@dataclass(frozen=True)
class Axis:
    """The parameter: what it is called, FCPMA's value, and whether its axis is in logs.

    `timed` adds a panel of the time, for parameters of speed.
    """

    label: str
    default: float | None = None
    logarithmic: bool = False
    timed: bool = False


def draw_curves(series: Series, parameter: Axis) -> Figure:
    """A panel per quantity with a curve per series; incomplete runs have a hollow mark.

    Parameters
    ----------
    series : mapping of label to sequence of (x, Measured)
        Jobs without a result leave a gap.
    parameter : Axis
    """
    figure = canvas(2.65)
    panels = PANELS if parameter.timed else PANELS[:-1]
    axes = figure.subplots(1, len(panels))
    for axis, (name, title) in zip(axes, panels, strict=True):
        panel(axis, series, name, parameter)
        axis.set_title(title)
    figure.supxlabel(parameter.label, fontsize=8.5, y=0.02)
    figure.text(0.99, 0.02, notes(series, parameter), ha="right", fontsize=8, color=GREY)
    handles, labels = axes[0].get_legend_handles_labels()
    rows = 0.13 if len(labels) > 1 else 0.0
    if rows:
        figure.legend(handles, labels, loc="upper center", ncols=len(labels))
    figure.subplots_adjust(left=0.055, right=0.99, bottom=0.175, top=0.90 - rows, wspace=0.3)
    return figure


def notes(series: Series, parameter: Axis) -> str:
    """What the marks mean, where there are such."""
    found = []
    if parameter.default is not None:
        found.append("dotted: FCPMA's")
    if any(m.placed and not m.complete for jobs in series.values() for _, m in jobs):
        found.append("hollow: not all placed")
    return "; ".join(found)


def panel(axis: Any, series: Series, name: str, parameter: Axis) -> None:
    """One quantity over the parameter."""
    drawn: list[float] = []
    for order, (label, jobs) in enumerate(series.items()):
        colour, marker = DATASETS.get(label, OTHERS[order % len(OTHERS)])
        known = sorted(
            (x, getattr(m, name), m.complete) for x, m in jobs if math.isfinite(getattr(m, name))
        )
        axis.plot([x for x, _, _ in known], [y for _, y, _ in known], marker=marker, color=colour,
                  label=label)  # fmt: skip
        for x, y, _ in (each for each in known if not each[2]):
            axis.plot(x, y, marker, color=colour, markerfacecolor="white")
        drawn += [y for _, y, _ in known]
    if not drawn:
        axis.text(0.5, 0.5, "not run", transform=axis.transAxes, ha="center", color=GREY)
        axis.set(xticks=[], yticks=[])
        return
    scale(axis, drawn, parameter, sorted({x for jobs in series.values() for x, _ in jobs}))


def scale(axis: Any, drawn: Sequence[float], parameter: Axis, values: Sequence[float]) -> None:
    """Choose the axes' scales and ticks."""
    if min(drawn) > 0 and max(drawn) > SPREAD * min(drawn):
        axis.set_yscale("log")
    else:
        axis.set_ylim(0, 1.08 * (max(drawn) or 1.0))
    if parameter.logarithmic:
        axis.set_xscale("log", base=2)
    if len(values) < 6:
        axis.set_xticks(values, [f"{x:g}" for x in values], minor=False)
    if parameter.default is not None:
        axis.axvline(parameter.default, color=GREY, linewidth=0.8, linestyle=":", zorder=0)
