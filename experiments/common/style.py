"""The common style of all figures, and how they are saved, for the width of a README."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.types import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Inches; a README shows about 850 pixels of 1/96 inch, so that a point of type stays a point.
WIDTH = 8.85
DPI = 200
GREY = "#555555"
#: What differs from matplotlib's own defaults.
RC: Any = {
    "font.family": "DejaVu Sans", "font.size": 8.5, "axes.titlesize": 9.5, "axes.labelsize": 8.5,
    "xtick.labelsize": 8.5, "ytick.labelsize": 8.5, "legend.fontsize": 8.5,
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": GREY,
    "xtick.color": GREY, "ytick.color": GREY, "xtick.labelcolor": "black",
    "ytick.labelcolor": "black", "axes.linewidth": 0.7, "lines.linewidth": 1.4,
    "lines.markersize": 4.5, "legend.frameon": False, "figure.facecolor": "white",
}  # fmt: skip

#: Of Okabe and Ito (2008), which the colour-blind tell apart; a method has the same everywhere.
METHODS = {
    "ocpra": "#E69F00", "ocpma": "#56B4E9", "fcpma": "#0072B2",
    "surfc": "#D55E00", "spant": "#009E73",
}  # fmt: skip
LABELS = {
    "ocpra": "OCPRA", "ocpma": "OCPMA", "fcpma": "FCPMA", "surfc": "SurfC", "spant": "SpanT",
}  # fmt: skip
#: Colour and marker of a data set's curve.
DATASETS = {
    "bunny": ("#0072B2", "o"), "dragon": ("#D55E00", "s"), "buddha": ("#009E73", "^"),
    "armadillo": ("#CC79A7", "D"), "figurine": ("#E69F00", "v"), "tiny": ("#56B4E9", "P"),
}  # fmt: skip
#: Of the scans: Okabe and Ito's, then P. Tol's "muted". No 15 colours differ for every eye, so
#: that those next to each other, of scans that mostly overlap, are told apart most easily.
SCANS = (
    "#0072B2", "#E69F00", "#332288", "#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#222222",
    "#B8A82A", "#882255", "#44AA99", "#F0B7A4", "#117733", "#AA4499", "#9A9A9A",
)  # fmt: skip


def scan_colours(count: int) -> Array:
    """Colours (count, 3) between 0 and 1 of the scans of a set, in their order."""
    from matplotlib.colors import to_rgb

    return np.array([to_rgb(SCANS[index % len(SCANS)]) for index in range(count)])


@contextmanager
def styled() -> Iterator[None]:
    """Inside, matplotlib draws in this style whatever the user's own settings are."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(RC)
        yield


def canvas(height: float, width: float = WIDTH) -> Figure:
    """An empty figure (inches), which no display and no state of pyplot is needed for."""
    from matplotlib.figure import Figure

    return Figure((width, height), DPI)


def save(figure: Figure, file: Path, colours: int = 0) -> Path:
    """Write a PNG that is the same, byte by byte, whenever it is drawn from the same numbers.

    Parameters
    ----------
    figure : Figure
    file : Path
    colours : int
        Reduce the picture to so many colours; 0 leaves it as it is. A drawing needs few, and is
        then a third of the size.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=DPI, metadata={"Software": None})
    if colours:
        from PIL import Image

        few = Image.open(file).convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        few.save(file, optimize=True)
    return file


def absent(axis: Any, words: str, title: str = "") -> None:
    """Leave a panel empty, and say why."""
    axis.set_axis_off()
    axis.text(0.5, 0.5, words, transform=axis.transAxes, ha="center", va="center", color=GREY)
    if title:
        axis.set_title(title)
