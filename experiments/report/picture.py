"""The README's picture: the figurine's scans as given, and registered."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import mvreg
from experiments.common.render import CLAY, Cloud, laid_out, render, smoothed, together
from mvreg.datasets.viewpoints import orbit
from mvreg.geometry import se3
from mvreg.surface.normals import Orient, estimate_normals
from mvreg.types import Array

FILE = Path(__file__).parents[1] / "results" / "figurine.png"
#: Of the picture; and the pixels above the panels.
DPI, TITLE = 200, 60


def scans_and_result() -> tuple[list[Cloud], list[Cloud]]:
    """The scans as given, each in its own frame, and placed, in the frame of the figure."""
    from matplotlib import colormaps

    scans = mvreg.dataset("figurine", rng=1, order="shuffle")
    result = mvreg.register(scans)
    if result.unregistered or scans.poses is None:
        raise SystemExit(f"not placed: {', '.join(result.unregistered)}")
    upright = scans.poses[result.reference]  # the truth, but only to stand the figure on its feet
    given, placed = [], []
    for index, scan in enumerate(scans.scans):
        colour = np.array(colormaps["Set3"](index)[:3])
        normals = estimate_normals(scan, scan.points, Orient.auto, 30)
        cloud = Cloud(scan.points, normals, np.broadcast_to(colour, scan.points.shape))
        given.append(cloud)
        placed.append(cloud.seen_from(se3.invert(upright @ result.poses[scan.name])))
    return given, placed


def panels() -> list[tuple[str, Array]]:
    """Titles and pictures, from left to right."""
    given, placed = scans_and_result()
    model = together(placed)
    middle = (model.points.min(axis=0) + model.points.max(axis=0)) / 2
    back = model.seen_from(orbit(middle, 1.0, 205, 8))
    front = smoothed(model).seen_from(orbit(middle, 1.0, 25, 8)).painted(CLAY)
    scans = laid_out(given, 4, 118, 165)
    return [
        (f"{len(given)} scans, unordered", render(scans, 4 * 118, 3 * 165, 1.4)),
        ("registered, coloured by scan", render(back, 122, 165, 4.2)),
        ("the same points in one colour", render(front, 122, 165, 4.2)),
    ]


def main(file: Path) -> None:
    """Draw the panels side by side, one pixel for each of theirs, and save few colours."""
    from matplotlib.figure import Figure
    from PIL import Image

    drawn = panels()
    heights, widths, _ = zip(*(image.shape for _, image in drawn), strict=True)
    size = (sum(widths) / DPI, (max(heights) + TITLE) / DPI)
    figure = Figure(size, DPI)
    axes = figure.subplots(1, len(drawn), width_ratios=widths)
    figure.subplots_adjust(0, 0, 1, 1 - TITLE / DPI / size[1], 0)
    for axis, (title, image) in zip(axes, drawn, strict=True):
        axis.imshow(image)
        axis.set_title(title, fontsize=9)
        axis.axis("off")
    figure.savefig(file)
    few = Image.open(file).convert("RGB").quantize(192, dither=Image.Dither.NONE)
    few.save(file, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
