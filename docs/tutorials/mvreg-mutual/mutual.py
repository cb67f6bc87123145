from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

import mvreg
from mvreg.types import Matches, View


@dataclass(frozen=True)
class MutualSeed:
    """Keypoints whose descriptors are each other's nearest, best first."""

    most: int = 100

    def __call__(self, source: View, target: View) -> Matches:
        apart = cdist(source.features.descriptors, target.features.descriptors)
        nearest = apart == apart.min(axis=1, keepdims=True, initial=np.inf)
        nearest &= apart == apart.min(axis=0, keepdims=True, initial=np.inf)
        best = np.argsort(apart[nearest], kind="stable")[: self.most]
        return Matches(np.argwhere(nearest)[best], apart[nearest][best])


@mvreg.hookimpl
def mvreg_stages():
    return {"seed/mutual": MutualSeed}
