"""The view graph: which placed views overlap, and their relative motions from pair-wise ICP.

What motion averaging and its relatives start from. The rule for the overlap is that of Li and Zhu
(3DV 2014): all the nearest-neighbour distances into a view are pooled and trimmed together, so that
one distance threshold serves for all its partners.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mvreg.contracts import Refine
from mvreg.geometry import se3
from mvreg.geometry.nearest import within
from mvreg.parallel import in_threads
from mvreg.stages.adjust.dense import dense
from mvreg.surface.overlap import neighbours
from mvreg.types import Array, Edge, Result, View

#: Points asked per ordered pair of views: a share of so many is known to a per cent.
MOST_POINTS = 2000


def edges(
    result: Result,
    views: Sequence[View],
    refine: Refine,
    min_overlap: float = 0.5,
    targets: Sequence[View] | None = None,
) -> list[Edge]:
    """Estimate the relative motion of every ordered pair of placed views that overlap enough.

    Parameters
    ----------
    result : Result
        Its poses say which views lie on each other, and where refinement starts.
    views : sequence of View
        All the prepared views; those without a pose are left out.
    refine : Refine
        Measures an edge, from ``M_i^-1 M_j``.
    min_overlap : float
        Pairs that share more than this are edges; 0.5 in Li and Zhu, 3DV 2014.
    targets : sequence of View, optional
        The same views as targets; ``dense(views)`` if not given. On the Bunny that takes the error
        of motion averaging to a third.

    Returns
    -------
    list of Edge
        Between positions in `views`, ordered by target, then source; a pair that overlaps both ways
        gives two. Empty where nothing does.
    """
    poses = result.poses
    shares = overlaps(poses, views)
    pairs = [(int(i), int(j)) for i, j in np.argwhere(shares > min_overlap)]
    if not pairs:
        return []
    targets = dense(views) if targets is None else targets
    for i, _ in pairs:
        _ = targets[i].tree  # built once, before the threads ask for it

    def measure(pair: tuple[int, int]) -> Edge:
        i, j = pair
        start = se3.invert(poses[views[i].name]) @ poses[views[j].name]
        found = refine(views[j], targets[i], start)
        share = float(shares[i, j])
        return Edge(j, i, found.T_target_source, share, found.trimmed_mse)

    return [edge for edge in in_threads(measure, pairs) if np.isfinite(edge.T_target_source).all()]


def overlaps(poses: Mapping[str, Array], views: Sequence[View]) -> Array:
    """The share of each view's points that lie on each other view, by the pooled threshold.

    For each view i, the distances from all other views' points to it are pooled; the prefix of
    the sorted pool that minimises psi, Eq. (4) with lambda = 2, ends at the threshold of view i,
    and ``shares[i, j]`` is the share of view j below it. Distances count as half the resolution at
    least, since closer than that is chance; farther than the keypoints' spacing is no overlap.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``.
    views : sequence of View
        Those without pose or points have shares of zero.

    Returns
    -------
    (N, N) array
        ``shares[i, j]``, zero on the diagonal.
    """
    shares = np.zeros((len(views), len(views)))
    placed = [k for k, view in enumerate(views) if view.name in poses and len(view.points)]
    reach = views[placed[0]].scale.spacing if placed else 0.0
    if len(placed) < 2 or not reach > 0:
        return shares
    partners: dict[int, list[int]] = {}
    for a, b in neighbours([views[k] for k in placed], poses, reach):
        partners.setdefault(placed[a], []).append(placed[b])
    for i in partners:
        _ = views[i].tree

    def row(i: int) -> list[float]:
        pools = [_distances(poses, views[j], views[i], reach) for j in partners[i]]
        threshold = _threshold(np.concatenate(pools), reach, views[i].scale.resolution / 2)
        return [float((pool <= threshold).mean()) for pool in pools]

    for i, found in zip(partners, in_threads(row, list(partners)), strict=True):
        shares[i, partners[i]] = found
    return shares


def _distances(poses: Mapping[str, Array], source: View, target: View, reach: float) -> Array:
    """Distances (M,) of some of the source's points to the target, infinite beyond `reach`."""
    transform = se3.invert(poses[target.name]) @ poses[source.name]
    step = -(-len(source.points) // MOST_POINTS)
    points = se3.apply(transform, source.points[::step])
    distances = np.full(len(points), np.inf)
    met, _, found = within(target.tree, points, reach)
    distances[met] = found
    return distances


def _threshold(pool: Array, reach: float, least: float) -> float:
    """The distance at which the best prefix of the pooled distances ends; -1 if none is finite."""
    ascending = np.sort(pool[pool <= reach])
    if not len(ascending):
        return -1.0
    ascending = np.maximum(ascending, least)
    count = np.arange(1, len(ascending) + 1)
    psi = np.cumsum((ascending / reach) ** 2) / count.astype(float) ** 4  # Eq. (4), lambda = 2
    return float(ascending[psi.argmin()])
