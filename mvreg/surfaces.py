"""How the surfaces of placed views lie on each other; needs no ground truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.kernels import overlap
from mvreg.parallel import in_parts
from mvreg.types import Array, Indices, View

#: Neighbours further apart than this are no overlap (resolutions).
REACH = 3.0
#: Normals that differ by more than about 45 degrees belong to different sheets of a surface.
LEAST_COSINE = 0.7
#: Points asked per ordered pair of views: the median of so many is stable to a per cent.
MOST_POINTS = 1000
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


def closeness(poses: Mapping[str, Array], views: Sequence[View]) -> float:
    """How much of the surfaces meets, and how closely: one number, to compare sets of poses by.

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
    reach = REACH * resolution
    pairs = neighbours(placed, poses, reach)
    inverse = [se3.invert(poses[view.name]) for view in placed]
    build_trees(placed)

    def heights(pair: tuple[int, int]) -> Array:
        source, target = (placed[k] for k in pair)
        return touch(source, target, inverse[pair[1]] @ poses[source.name], reach, most)[1]

    return [found for found in in_parts(heights, pairs) if len(found)]


def build_trees(views: Sequence[View]) -> None:
    """Build the trees of all views, before threads ask for them one by one."""
    for view in views:
        _ = view.tree


def neighbours(
    views: Sequence[View], poses: Mapping[str, Array], reach: float
) -> list[tuple[int, int]]:
    """Ordered pairs of views whose boxes in the model frame come within `reach` of each other.

    Parameters
    ----------
    views : sequence of View
        All with points, all with a pose.
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``.
    reach : float
        Length.

    Returns
    -------
    list of (int, int)
        Positions in `views`.
    """
    boxes = [overlap.box(view.points, poses[view.name]) for view in views]
    pairs = _meeting([low for low, _ in boxes], [high for _, high in boxes], reach)
    return sorted([*pairs, *((j, i) for i, j in pairs)])


def near_boxes(clouds: Sequence[Array], reach: float) -> list[tuple[int, int]]:
    """Pairs i < j of clouds (N, 3) whose boxes come within `reach` (length) of each other.

    A sweep along the first axis; the other two are asked only of those that meet on it, so that
    the time goes with the number of pairs that do.
    """
    low, high = ([end(cloud, axis=0) for cloud in clouds] for end in (np.min, np.max))
    return _meeting(low, high, reach)


def _meeting(
    lowest: Sequence[Array], highest: Sequence[Array], reach: float
) -> list[tuple[int, int]]:
    """Pairs i < j of boxes that come within `reach` of each other."""
    low, high = np.stack(lowest) - reach / 2, np.stack(highest) + reach / 2
    order = np.argsort(low[:, 0], kind="stable")
    ends = np.searchsorted(low[order, 0], high[order, 0], side="right")
    found = []
    for place, i in enumerate(order):
        others = order[place + 1 : ends[place]]
        meet = (low[others] <= high[i]).all(axis=1) & (low[i] <= high[others]).all(axis=1)
        found += [(int(min(i, j)), int(max(i, j))) for j in others[meet]]
    return sorted(found)


def asked(view: View, most: int = MOST_POINTS) -> slice:
    """The points of a view that are asked: at most so many, evenly spread over the list."""
    return slice(None, None, max(1, -(-len(view.points) // most)))


def touch(
    source: View, target: View, T_target_source: Array, reach: float, most: int = MOST_POINTS
) -> tuple[Indices, Array]:
    """Where the asked points of a view, at most so many, lie on the surface of another.

    Returns
    -------
    which : (M,) array
        Positions among the points `asked`: those with a neighbour within `reach` (length), and a
        normal that agrees with its own.
    heights : (M,) array
        Their distances from the tangent planes there (length).
    """
    chosen = asked(source, most)
    return overlap.touch(
        target.tree, target.normals, source.points[chosen], source.normals[chosen],
        T_target_source, reach, LEAST_COSINE,
    )  # fmt: skip
