"""Consistency of placed surfaces, as point-to-plane distances; needs no ground truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array
from mvreg.parallel import in_parts
from mvreg.surface.overlap import (
    CONTACT_DISTANCE,
    MOST_POINTS,
    build_trees,
    contact_heights,
    neighbours,
)
from mvreg.types import View

#: Of more views than this, sets of poses are compared by fewer points a pair, but by so many at
#: least: what is asked of a view then does not grow with the number of views that it meets.
MANY_VIEWS, FEWEST_POINTS = 16, 100


@dataclass(frozen=True)
class Consistency:
    """Point-to-plane distances where placed views overlap: `median` and `rms` (length).

    `resolution` (length) is what the relative figures divide by; `points` distances were measured
    in `pairs` ordered pairs of views.
    """

    median: float
    rms: float
    resolution: float
    points: int
    pairs: int

    @property
    def relative_median(self) -> float:
        """The median in resolutions."""
        return self.median / self.resolution

    @property
    def relative_rms(self) -> float:
        """The RMS in resolutions."""
        return self.rms / self.resolution


def consistency(poses: Mapping[str, Array], views: Sequence[View]) -> Consistency | None:
    """How well the placed surfaces lie on each other; needs no ground truth.

    For every ordered pair of views whose bounding boxes overlap, points of one find their nearest
    neighbour in the other within 3 resolutions; where the normals agree, the distance along the
    other's normal counts. Points are taken evenly from each list, so the answer is deterministic.

    It measures how tightly overlaps close, not whether they are the right ones: a false placement
    that touches nothing leaves no trace here.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``; views without a pose are left out.
    views : sequence of View
        Registration points and normals, each in its scan's frame.

    Returns
    -------
    Consistency or None
        None where nothing overlaps.
    """
    found = _heights(poses, views)
    if not found:
        return None
    distances = np.concatenate(found)
    return Consistency(
        median=float(np.median(distances)),
        rms=float(np.sqrt(np.mean(distances**2))),
        resolution=views[0].scale.resolution,
        points=len(distances),
        pairs=len(found),
    )


def fit_score(poses: Mapping[str, Array], views: Sequence[View]) -> float:
    """Truncated least-squares score of placed surfaces, to compare sets of poses by.

    Truncated least squares: every distance h that `consistency` measures counts ``1 - h^2``, in
    resolutions, if that is positive. Unlike the mean distance it does not fall when surfaces begin
    to meet that were apart before. Larger is better; zero where nothing meets. Comparable for poses
    of the same views.
    """
    most = max(FEWEST_POINTS, MOST_POINTS * MANY_VIEWS // max(len(views), MANY_VIEWS))
    return sum(
        float(np.maximum(0.0, 1 - (heights / views[0].scale.resolution) ** 2).sum())
        for heights in _heights(poses, views, most)
    )


def _heights(
    poses: Mapping[str, Array], views: Sequence[View], most: int = MOST_POINTS
) -> list[Array]:
    """Point-to-plane distances of the ordered pairs of views that meet, see `consistency`."""
    placed = [view for view in views if view.name in poses and len(view.points)]
    resolution = placed[0].scale.resolution if placed else 0.0
    if len(placed) < 2 or not resolution > 0:
        return []
    reach = CONTACT_DISTANCE * resolution
    pairs = neighbours(placed, poses, reach)
    inverse = [se3.invert(poses[view.name]) for view in placed]
    build_trees(placed)

    def heights(pair: tuple[int, int]) -> Array:
        source, target = (placed[k] for k in pair)
        return contact_heights(source, target, inverse[pair[1]] @ poses[source.name], reach, most)[
            1
        ]

    return [found for found in in_parts(heights, pairs) if len(found)]
