"""A picture of real scans for the README: as given, registered, and in cross-section."""

from __future__ import annotations

from typing import TYPE_CHECKING

from experiments.common.scenes import Scene
from experiments.common.style import canvas
from experiments.report.comparison import HEAD, LINE, Sheet, credit
from experiments.report.panels import model, painted, part, scans_as_given, slices, whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_showcase(scene: Scene, method: str) -> Figure:
    """Four columns: scans, placed scans by colour, a cross-section and a part of it."""
    cut = slices(scene, [method])
    width = Sheet(canvas(1), 4, 1).width
    total = HEAD + width + LINE
    sheet = Sheet(canvas(total), 4, total)
    titles = (f"{len(scene.clouds)} scans, unordered", "registered", "cross-section", "enlarged")
    for column, title in enumerate(titles):
        sheet.head(column, title)
    painted(sheet.axes(0, HEAD, width), scans_as_given(scene, 0.97 * width, width))
    painted(sheet.axes(1, HEAD, width), model(scene, method, 0.97 * width, width, coloured=True))
    whole(sheet.axes(2, HEAD, width), cut, method, scene)
    part(sheet.axes(3, HEAD, width), cut, method, scene)
    credit(sheet, [scene.name])
    return sheet.figure
