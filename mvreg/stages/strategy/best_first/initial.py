"""What poses known beforehand mean to the order of attempts, and to the first groups."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.boxes import near_boxes
from mvreg.geometry.nearest import nearest
from mvreg.kernels.overlap import box
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.types import Array, View

#: Points of a view that are asked whether they lie near another one, and how near (resolutions):
#: poses known beforehand may be so far off.
ASKED, NEAR = 200, 10.0


def join_fixed(models: PartialModels) -> list[int]:
    """Put the views of fixed scans into one group; return their positions."""
    held = [
        (k, scan.initial)
        for k, view in enumerate(models.views)
        if (scan := view.scan) is not None and scan.fixed and scan.initial is not None
    ]
    for k, pose in held[1:]:
        first, frame = held[0]
        models.join(k, first, se3.invert(frame) @ pose)
    return [k for k, _ in held]


def with_initial_overlap(scores: Array, views: Sequence[View]) -> Array:
    """Overlap scores (N, N), raised where poses known beforehand let views overlap.

    To the share of points that then lie near the other view, in units of the largest score: so
    pairs that descriptors say little of are tried, too.
    """
    known = {
        k: scan.initial
        for k, view in enumerate(views)
        if (scan := view.scan) is not None and scan.initial is not None and len(view.points)
    }
    if len(known) < 2:
        return scores
    chosen = list(known)
    reach = NEAR * views[chosen[0]].scale.resolution
    boxes = [np.stack(box(views[k].points, known[k])) for k in chosen]
    highest = float(scores.max(initial=0.0)) or 1.0
    found = scores.copy()
    for a, b in near_boxes(boxes, reach):
        i, j = chosen[a], chosen[b]
        share = highest * max(_near(views, known, i, j, reach), _near(views, known, j, i, reach))
        found[i, j] = found[j, i] = max(found[i, j], found[j, i], share)
    return found


def _near(views: Sequence[View], known: dict[int, Array], i: int, j: int, reach: float) -> float:
    """Share of the points of view i that lie near view j."""
    points = views[i].points[:: -(-len(views[i].points) // ASKED)]
    moved = se3.apply(se3.invert(known[j]) @ known[i], points)
    return float(np.isfinite(nearest(views[j].tree, moved, reach)[0]).mean())
