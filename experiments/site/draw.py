"""Draw the figures of the documentation again.

    python -m experiments.site.draw [NAME ...]

They are made of runs on the embedded data sets, made on the spot, and written to ``docs/pictures``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.common.style import save, styled
from experiments.site.evidence import draw_evidence
from experiments.site.graph import draw_adjustment, draw_graph
from experiments.site.places import draw_heap, draw_places, draw_yard
from experiments.site.search import draw_search
from mvreg.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PICTURES = Path(__file__).parents[2] / "docs" / "pictures"
#: What draws each, and the number of colours that it is reduced to.
FIGURES: dict[str, tuple[Callable[[], Figure], int]] = {
    "places": (draw_places, 64),
    "heap": (draw_heap, 160),
    "yard": (draw_yard, 32),
    "search": (draw_search, 64),
    "evidence": (draw_evidence, 32),
    "graph": (draw_graph, 64),
    "adjustment": (draw_adjustment, 64),
}


def main(names: Sequence[str], out: Path = PICTURES) -> None:
    """Draw these figures, all if none is named.

    Raises
    ------
    InputError
        If there is no such figure; lists them.
    """
    if unknown := sorted(set(names) - set(FIGURES)):
        raise InputError(f"no figure {', '.join(unknown)}; there are: {', '.join(FIGURES)}")
    with styled():
        for name in names or FIGURES:
            draw, colours = FIGURES[name]
            print(save(draw(), out / f"{name}.png", colours))


if __name__ == "__main__":
    main(sys.argv[1:])
