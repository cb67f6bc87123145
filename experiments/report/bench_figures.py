"""How time, pairs and memory grow: log-log, with fitted exponents."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.bench.records import Record, latest
from experiments.bench.tables import COSTS, fitted, grouped, of
from experiments.common.style import GREY, METHODS, canvas, save, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Colour and marker of a method's curve.
CURVES = {
    "fcpma": (METHODS["fcpma"], "o"), "auto": ("#CC79A7", "s"), "ocpma": (METHODS["ocpma"], "^"),
    "ocpra": (METHODS["ocpra"], "D"),
}  # fmt: skip
FIGURES = {"scans": "number of scans N", "points": "points per scan"}


def draw(records: Sequence[Record], out: Path) -> list[Path]:
    """Draw what was measured; returns the files written."""
    written = []
    with styled():
        for part, label in FIGURES.items():
            own = [r for r in latest(records, part) if r.answer is not None]
            if own:
                written.append(save(growth_figure(own, label), out / f"bench_{part}.png", 64))
    return written


def growth_figure(records: Sequence[Record], label: str) -> Figure:
    """A panel for each cost, a curve for each method; hollow where not all scans are placed."""
    figure = canvas(2.9)
    for axis, (cost, title) in zip(figure.subplots(1, len(COSTS)), COSTS.items(), strict=True):
        for row in sorted({r.row for r in records}):
            curve(axis, records, row, cost)
        axis.set(xscale="log", yscale="log", title=title)
        ticks(axis, sorted({r.size for r in records}))
        axis.legend(loc="upper left")
        axis.margins(y=0.25)
    figure.supxlabel(label, fontsize=8.5, y=0.02)
    figure.text(0.99, 0.02, "lines: fitted; hollow: not all placed", ha="right", fontsize=8,
                color=GREY)  # fmt: skip
    figure.subplots_adjust(left=0.07, right=0.99, bottom=0.175, top=0.91, wspace=0.25)
    return figure


def curve(axis: Any, records: Sequence[Record], row: str, cost: str) -> None:
    """The medians of a method, and the power law that fits them."""
    colour, marker = CURVES.get(row, (GREY, "v"))
    known = sorted(
        (runs[0].size, found.median, found.least, found.most, complete(runs))
        for (_, name), runs in grouped(records).items()
        if name == row and (found := of(runs, cost)) is not None
    )
    for size, middle, least, most, whole in known:
        axis.plot(size, middle, marker, color=colour,
                  markerfacecolor=colour if whole else "white")  # fmt: skip
        axis.plot([size, size], [least, most], color=colour, linewidth=0.8)
    law = fitted(records, row, cost)
    if law is None:
        axis.plot([], [], marker, color=colour, label=row)
        return
    ends = [known[0][0], known[-1][0]]
    axis.plot(ends, [law.at(size) for size in ends], color=colour, linewidth=1,
              label=f"{row}: exponent {law.exponent:z.2f}")  # fmt: skip


def complete(runs: Sequence[Record]) -> bool:
    """Whether every run placed every scan."""
    return all(r.answer["placed"] == r.answer["scans"] for r in runs if r.answer is not None)


def ticks(axis: Any, sizes: Sequence[int]) -> None:
    """Name the sizes that were measured; costs as plain numbers."""
    from matplotlib.ticker import EngFormatter, LogLocator, NullFormatter, StrMethodFormatter

    names = [EngFormatter(sep="")(size) for size in sizes]
    axis.set_xticks(sizes, names, minor=False)
    axis.xaxis.set_minor_formatter(NullFormatter())
    low, high = axis.get_ylim()
    axis.yaxis.set_major_locator(LogLocator(subs=(1.0,) if high > 30 * low else (1, 2, 5)))
    axis.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())
