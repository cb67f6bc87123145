"""Nearest neighbours: trees built for surfaces, and queries that always have a distance bound."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from mvreg.geometry.arrays import Array, Indices
from mvreg.parallel import in_threads, slices, threads

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree

__all__ = [
    "build_tree",
    "mean_spacing",
    "median_spacing",
    "nearest",
    "within",
]

#: Queries run on all cores; the answers do not depend on how many there are.
WORKERS = threads()
#: So many queries make a part worth a thread's while.
FEW = 2000


def build_tree(points: Array) -> Tree:
    """A k-d tree over points (N, 3)."""
    from mvreg.kernels.tree import Tree

    return Tree(points)


def nearest(tree: Tree, queries: Array, bound: float = np.inf) -> tuple[Array, Indices]:
    """The nearest neighbour of each query (M, 3) within `bound` (length).

    Returns
    -------
    distances : (M,) array
        Infinite where there is no neighbour within the bound.
    indices : (M,) array
        ``tree.n`` where there is no neighbour within the bound.
    """
    return in_slices(lambda some: tree.nearest(some, bound), queries)


def neighbours_of(
    tree: Tree, queries: Array, count: int, bound: float = np.inf
) -> tuple[Array, Indices]:
    """The `count` nearest neighbours of each query (M, 3): distances, indices (M, count).

    What is missing within `bound` (length) is as in `nearest`.
    """
    ranks = list(range(1, count + 1))
    return in_slices(lambda some: tree.query(some, ranks, bound), queries)


def in_slices(
    ask: Callable[[Array], tuple[Array, Indices]], queries: Array
) -> tuple[Array, Indices]:
    """What `ask` answers for all queries, a part of them in each thread if there are many."""
    parts = slices(len(queries), FEW)
    if len(parts) == 1:
        return ask(queries)
    answers = in_threads(lambda part: ask(queries[part]), parts)
    distances, indices = zip(*answers, strict=True)
    return np.concatenate(distances), np.concatenate(indices)


def within(tree: Tree, queries: Array, reach: float) -> tuple[Indices, Indices, Array]:
    """The queries that have a neighbour within `reach` (length), if there are any.

    The tree's box is asked first: most points of clouds that hardly overlap then cost no query.

    Returns
    -------
    which, partners : (M,) arrays
        Positions among the queries, ascending, and of their nearest neighbours in the tree.
    distances : (M,) array
    """
    if not tree.n or not len(queries):
        none = np.empty(0, dtype=np.intp)
        return none, none, np.empty(0)
    inside = ((queries >= tree.mins - reach) & (queries <= tree.maxes + reach)).all(axis=1)
    asked = np.flatnonzero(inside)
    distances, partners = nearest(tree, queries[asked], reach)
    found = np.isfinite(distances)
    return asked[found], partners[found], distances[found]


def mean_spacing(points: Array, tree: Tree | None = None, most: int = 5000) -> float:
    """Mean distance of a point to the nearest other point, d_X (length).

    Of `points` (N, 3) at most `most` are asked, evenly spread over the list. Duplicates count as
    one point. Zero where all points coincide or there is only one.
    """
    if len(points) < 2:
        return 0.0
    step = -(-len(points) // most)
    if tree is None:
        tree = build_tree(points)
    distances, _ = neighbours_of(tree, points[::step], 2)
    if (distances[:, 1] > 0).all():
        return float(distances[:, 1].mean())
    unique = np.unique(points, axis=0)
    return mean_spacing(unique, None, most) if len(unique) < len(points) else 0.0


def median_spacing(clouds: Sequence[Array]) -> float:
    """Median over the clouds (N, 3) of `mean_spacing`: one length for a whole set."""
    return median_positive(in_threads(mean_spacing, clouds))


def median_positive(spacings: Sequence[float]) -> float:
    """Median of the spacings above zero; zero where there is none."""
    known = [spacing for spacing in spacings if spacing > 0]
    return float(np.median(known)) if known else 0.0
