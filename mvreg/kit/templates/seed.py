"""Matches of descriptors: ``seed=nameless``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from mvreg.errors import check_positive
from mvreg.types import Matches, View


@dataclass(frozen=True)
class NamelessSeed:
    """Keypoints whose descriptors are each other's nearest, the best of them first.

    Parameters
    ----------
    most : int
        No more matches than this.
    """

    most: int = 100

    def __post_init__(self) -> None:
        check_positive("seed", most=self.most)

    def __call__(self, source: View, target: View) -> Matches:
        """Match the keypoints of two views.

        Returns
        -------
        Matches
            Index pairs (M, 2) of source and target, and the distances (M,) of their descriptors,
            ascending; none where a view has no keypoints.
        """
        own, other = source.features.descriptors, target.features.descriptors
        if not (len(own) and len(other)):
            return Matches(np.empty((0, 2), dtype=np.intp), np.empty(0))
        apart = cdist(own, other)
        nearest, back = apart.argmin(axis=1), apart.argmin(axis=0)
        mutual = np.flatnonzero(back[nearest] == np.arange(len(own)))
        distances = apart[mutual, nearest[mutual]]
        best = np.argsort(distances, kind="stable")[: self.most]
        return Matches(np.stack([mutual, nearest[mutual]], axis=1)[best], distances[best])
