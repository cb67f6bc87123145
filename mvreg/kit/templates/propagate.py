"""Candidate poses out of seed matches: ``propagate=nameless``."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import Array, se3
from mvreg.geometry.nearest import nearest
from mvreg.stages import ConsensusPropagate
from mvreg.types import Candidates, Matches, View


@dataclass(frozen=True)
class NamelessPropagate(ConsensusPropagate):
    """Consensus as mvreg finds it, the candidates ranked by all points instead of keypoints alone.

    A stage may build on another: its parameters and their checks are inherited.

    Parameters
    ----------
    nearest_share : float
        Of the source's registration points, those nearest to the target, that count for the rank.
    """

    nearest_share: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.nearest_share <= 1:
            raise InputError(
                f"propagate.nearest_share: expected a share in (0, 1], got {self.nearest_share}"
            )

    def __call__(
        self, source: View, target: View, seeds: Matches, rng: np.random.Generator
    ) -> Candidates:
        """Find poses.

        Returns
        -------
        Candidates
            ``T_target_source`` (C, 4, 4), and as scores the mean squared distances of the nearest
            points (length^2), ascending.
        """
        found = super().__call__(source, target, seeds, rng)
        if not len(found) or not len(target.points):
            return found
        scores = np.array([self.distance(source, target, pose) for pose in found.poses])
        best = np.argsort(scores, kind="stable")
        return replace(
            found, poses=found.poses[best], scores=scores[best],
            matches=tuple(found.matches[k] for k in best),
        )  # fmt: skip

    def distance(self, source: View, target: View, pose: Array) -> float:
        """How far the nearest of the source's points are from the target, squared, on average."""
        distances, _ = nearest(target.tree, se3.apply(pose, source.points))
        kept = max(1, round(self.nearest_share * len(distances)))
        return float((np.sort(distances)[:kept] ** 2).mean())
