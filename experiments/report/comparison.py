"""Fig. 9: unordered scans, a cross-section of each method's result, and the merged model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.common.scenes import Scene
from experiments.common.style import GREY, LABELS, WIDTH, absent, canvas
from experiments.report.measured import Measured
from experiments.report.panels import Slices, model, painted, part, scans_as_given, slices, whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Of the Stanford 3D Scanning Repository, which is to be named wherever its scans are shown.
STANFORD = {"armadillo", "bunny", "buddha", "dragon"}
#: Of the width: left of the columns, and right of them.
LEFT, RIGHT = 0.025, 0.995
#: Inches: above the rows, a row without a scene, between rows, and a line of type.
HEAD, SHORT, GAP, LINE = 0.32, 0.3, 0.2, 0.19


@dataclass(frozen=True)
class Row:
    """One data set: its scene, None where it cannot be loaded, and the figures of each method."""

    name: str
    scene: Scene | None
    methods: Mapping[str, Measured] = field(default_factory=dict)


@dataclass(frozen=True)
class Sheet:
    """A figure on which axes are placed in inches from the top, in columns of equal width."""

    figure: Figure
    columns: int
    height: float

    @property
    def width(self) -> float:
        """Of a column, in inches."""
        return (RIGHT - LEFT) * WIDTH / self.columns

    def axes(self, column: int, top: float, height: float) -> Any:
        """New axes, a little narrower than their column."""
        left = LEFT + column * self.width / WIDTH
        bottom = 1 - (top + height) / self.height
        return self.figure.add_axes(
            (left + 0.004, bottom, self.width / WIDTH - 0.008, height / self.height)
        )

    def head(self, column: int, title: str) -> None:
        """What stands above a column."""
        self.write(self.middle(column), HEAD / 2, title, fontsize=9.5)

    def middle(self, column: int) -> float:
        """Of a column, as a share of the figure's width."""
        return LEFT + (column + 0.5) * self.width / WIDTH

    def write(self, across: float, top: float, text: str, **how: Any) -> None:
        """Text, centred at a share of the width and at inches from the top."""
        self.figure.text(
            across, 1 - top / self.height, text, **{"ha": "center", "va": "center"} | how
        )


def draw_comparison(rows: Sequence[Row], methods: Sequence[str], best: str) -> Figure:
    """A row per data set, a column per method between the scans as given and the model.

    Parameters
    ----------
    rows : sequence of Row
    methods : sequence of str
        The columns, from left to right.
    best : str
        The method whose result is painted as the model.
    """
    cut = {row.name: slices(row.scene, methods) for row in rows if row.scene is not None}
    width = (RIGHT - LEFT) * WIDTH / (len(methods) + 2)
    heights = [row_height(cut.get(row.name), width) for row in rows]
    total = HEAD + sum(heights) + LINE
    sheet = Sheet(canvas(total), len(methods) + 2, total)
    titles = ["scans, unordered", *(LABELS[m] for m in methods), f"model ({LABELS[best]})"]
    for column, title in enumerate(titles):
        sheet.head(column, title)
    tops = HEAD + np.cumsum([0.0, *heights[:-1]])
    for row, top, height in zip(rows, tops, heights, strict=True):
        if row.scene is None:
            words = [found.word for found in row.methods.values() if found.word]
            word = words[0] if words else "scans not on this machine"
            sheet.write(0.5, top + height / 2, f"{row.name}: {word}", color=GREY)
            continue
        sheet.write(LEFT / 2, top + height / 2, row.name, rotation=90, fontsize=9.5)
        draw_row(sheet, row, cut[row.name], methods, best, top)
    credit(sheet, [row.name for row in rows if row.scene is not None])
    return sheet.figure


def credit(sheet: Sheet, names: Sequence[str]) -> None:
    """At the foot, whose scans these are."""
    if STANFORD.intersection(names):
        text = "scans: Stanford Computer Graphics Laboratory"
        sheet.write(RIGHT, sheet.height - LINE / 2, text, ha="right", fontsize=8, color=GREY)


def row_height(cut: Slices | None, width: float) -> float:
    """Inches: a line of type, the cross-section, its part, a gap."""
    return SHORT if cut is None else LINE + width * cut.aspect + 0.05 + width + GAP


def draw_row(
    sheet: Sheet, row: Row, cut: Slices, methods: Sequence[str], best: str, top: float
) -> None:
    """One data set."""
    scene, width = row.scene, sheet.width
    assert scene is not None
    tall = width * cut.aspect
    height = LINE + tall + 0.05 + width
    painted(sheet.axes(0, top, height), scans_as_given(scene, 0.97 * width, height))
    for column, method in enumerate(methods, start=1):
        above = sheet.axes(column, top + LINE, tall)
        if method not in cut.cuts:
            absent(above, row.methods[method].word)
            continue
        whole(above, cut, method, scene)
        text = caption(row.methods[method])
        sheet.write(sheet.middle(column), top + LINE / 2, text, fontsize=8)
        part(sheet.axes(column, top + LINE + tall + 0.05, width), cut, method, scene)
    axis = sheet.axes(len(methods) + 1, top, height)
    if best in scene.poses:
        painted(axis, model(scene, best, 0.97 * width, height))
    else:
        absent(axis, row.methods[best].word)


def caption(found: Measured) -> str:
    """What a method says of itself, in a line above its cross-section."""
    placed = f"{found.placed}/{found.total} placed"
    return placed if np.isnan(found.rotation) else f"{placed}, $e_R$ {found.rotation:.4f}"
