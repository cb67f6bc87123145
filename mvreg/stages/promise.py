"""Which scans are likely to overlap, told from descriptors alone: what to try first."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mvreg.nearest import WORKERS
from mvreg.parallel import in_threads
from mvreg.stages.describe import EigenvaluesDescribe
from mvreg.types import Array, Indices, Scan, View

#: Descriptors asked for beyond those wanted, since the nearest ones are often a view's own.
SPARE = 60


def promise(views: Sequence[View], radii: Sequence[float], neighbours: int) -> Array:
    """How many keypoints of two views look alike, for all pairs of views at once.

    The descriptors of all views go into one k-d tree. Each keypoint gives a vote to the views of
    the `neighbours` descriptors nearest to its own, its own view left out (retrieval by local
    descriptors, as of images: Sivic and Zisserman 2003). The votes of a pair are divided by the
    geometric mean of all votes for the one and for the other, since some scans look like any other.

    Parameters
    ----------
    views : sequence of View
    radii : sequence of float
        Of the descriptors' neighbourhoods, in units of the keypoints' spacing, ascending.
    neighbours : int
        How many votes a keypoint has.

    Returns
    -------
    (N, N) array
        Symmetric, 0 or more, zero on the diagonal. No pose is looked for.
    """
    votes = _votes(described(views, radii), neighbours)
    votes = votes + votes.T
    total = np.sqrt(votes.sum(axis=0))
    shared: Array = votes / np.maximum(np.outer(total, total), np.finfo(float).tiny)
    return shared


def described(views: Sequence[View], radii: Sequence[float]) -> list[Array]:
    """Descriptors (K, D) of the keypoints of each view, at `radii` in units of their spacing."""
    describe = EigenvaluesDescribe(radii=list(radii), normal_scale=0)

    def one(view: View) -> Array:
        if not len(view.features.keypoints):
            return np.empty((0, 3 * len(radii)))
        scan = Scan(view.name, view.points) if view.scan is None else view.scan
        return describe(scan, view.features.keypoints, view.scale.spacing).descriptors

    return in_threads(one, views)


def _votes(descriptors: Sequence[Array], neighbours: int) -> Array:
    """(N, N) votes of the row's view for the column's; a view's own add up to 1 at most."""
    count = len(descriptors)
    votes = np.zeros((count, count))
    owners: Indices = np.repeat(np.arange(count), [len(own) for own in descriptors])
    if not len(owners):
        return votes
    ask = _neighbours_of(np.concatenate(descriptors))
    waiting = np.arange(len(owners))
    # Few have to look far: most of the nearest are of other views.
    for most in (3 * neighbours + 1, 4 * neighbours + SPARE):
        voted = owners[ask(waiting, min(most, len(owners)))]
        foreign = voted != owners[waiting, None]
        counted = foreign & (np.cumsum(foreign, axis=1) <= neighbours)
        full = (counted.sum(axis=1) == neighbours) | (most > 3 * neighbours + 1)
        rows, columns = np.nonzero(counted & full[:, None])
        np.add.at(votes, (owners[waiting[rows]], voted[rows, columns]), 1.0)
        waiting = waiting[~full]
    sizes = np.maximum([len(own) for own in descriptors], 1)
    shares: Array = votes / (neighbours * sizes[:, None])
    return shares


def _neighbours_of(descriptors: Array) -> Callable[[Indices, int], Indices]:
    """The nearest of some descriptors (M, D), by their positions: (Q,), k -> (Q, k).

    The tree is over their principal components, which keep all distances: it is twice as fast.
    """
    from scipy.spatial import cKDTree

    centred = descriptors - descriptors.mean(axis=0)
    turned = centred @ np.linalg.eigh(centred.T @ centred)[1][:, ::-1]
    tree = cKDTree(turned, leafsize=30)

    def ask(which: Indices, count: int) -> Indices:
        found: Indices = tree.query(turned[which], k=np.arange(1, count + 1), workers=WORKERS)[1]
        return found

    return ask
