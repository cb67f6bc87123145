"""Which of many overlapping views are compared: enough of them, well spread, not all.

Where every view meets most others, as all around one object, the pairs that meet grow with the
square of the views. What they tell of a pose does not: a part of a surface that eight other views
have seen is no better known by eighty.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

#: Partners of a view at most, besides those that chose it and those of a spanning tree. On
#: ``figurine`` with 60 views 16 move the poses by 0.01 resolutions.
MOST = 16
#: Points of a view that its place is told by, and the edge of the cells (resolutions) in which two
#: views are in one place.
ASKED, CELL = 400, 6.0
#: The best by overlap, so many times `MOST`, are considered.
CONSIDERED = 8
#: What lies where another partner does counts so much.
TIE = 0.01


def well_spread(
    pairs: Sequence[tuple[int, int]],
    points: Sequence[Array],
    poses: Sequence[Array],
    resolution: float,
    most: int = MOST,
) -> list[tuple[int, int]]:
    """Of the pairs of views that may meet those that say enough of every view.

    Every view chooses up to `most` partners, one after another: that of the largest overlap, times
    the share of it that lies apart from every partner so far (maximal marginal relevance,
    Carbonell and Goldstein 1998). A pair is kept if either has chosen it, or if the spanning tree
    of largest overlaps needs it. Of views with no more than `most` partners all pairs are kept.

    Parameters
    ----------
    pairs : sequence of (int, int)
        i < j, or both ways: then both ways are kept.
    points : sequence of (N, 3) arrays
        Of the views, each in its own frame.
    poses : sequence of (4, 4) arrays
        ``T_model_view``.
    resolution : float
        Length.
    most : int

    Returns
    -------
    list of (int, int)
        In the order of `pairs`, which is returned itself where nothing is left out.
    """
    partners: dict[int, set[int]] = {}
    for i, j in pairs:
        partners.setdefault(i, set()).add(j)
        partners.setdefault(j, set()).add(i)
    if not resolution > 0 or all(len(others) <= most for others in partners.values()):
        return list(pairs)
    cells = _cells(points, poses, CELL * resolution)
    shared = (cells @ cells.T).tocsr()
    kept = {_ends(i, j) for i, j in _tree(shared)}
    for i, others in partners.items():
        kept |= {_ends(i, j) for j in _chosen(i, sorted(others), shared, most)}
    return [pair for pair in pairs if _ends(*pair) in kept]


def _ends(i: int, j: int) -> tuple[int, int]:
    return (i, j) if i < j else (j, i)


def _cells(points: Sequence[Array], poses: Sequence[Array], edge: float) -> csr_array:
    """Which cells (columns) each view (row) is in: 0 or 1."""
    from scipy.sparse import csr_array

    moved = [
        se3.apply(pose, cloud[:: -(-len(cloud) // ASKED) or 1])
        for cloud, pose in zip(points, poses, strict=True)
    ]
    everything = np.floor(np.concatenate(moved) / edge).astype(np.int64)
    _, column = np.unique(everything, axis=0, return_inverse=True)
    row = np.repeat(np.arange(len(moved)), [len(cloud) for cloud in moved])
    found = csr_array((np.ones(len(row)), (row, column.ravel())))
    found.data[:] = 1.0  # duplicates have been added up
    return found


def _tree(shared: csr_array) -> list[tuple[int, int]]:
    """The pairs of a spanning forest of the largest overlaps."""
    from scipy.sparse.csgraph import minimum_spanning_tree

    costs = shared.copy()
    costs.setdiag(0)
    costs.eliminate_zeros()
    costs.data = 1.0 / costs.data
    tree = minimum_spanning_tree(costs).tocoo()
    return list(zip(tree.row.tolist(), tree.col.tolist(), strict=True))


def _chosen(i: int, others: list[int], shared: csr_array, most: int) -> list[int]:
    """The partners that view i chooses."""
    if len(others) <= most:
        return others
    overlaps = shared[[i]].toarray()[0][others]
    order = np.argsort(-overlaps, kind="stable")[: CONSIDERED * most]
    candidates = np.array(others)[order]
    overlaps = overlaps[order]
    sizes = np.maximum(shared.diagonal()[candidates], 1.0)
    alike = shared[candidates][:, candidates].toarray() / sizes[:, None]
    left, chosen = np.ones(len(candidates)), list[int]()
    for _ in range(min(most, len(candidates))):
        gains = overlaps * left
        gains[chosen] = -1.0
        best = int(gains.argmax())
        chosen.append(best)
        left = np.minimum(left, 1 + TIE - alike[:, best])
    return [int(j) for j in candidates[chosen]]
