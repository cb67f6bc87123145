"""Accurate poses out of coarse ones: ``refine=nameless``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError, check_positive
from mvreg.geometry import Array, se3
from mvreg.geometry.nearest import nearest
from mvreg.types import Registration, View


@dataclass(frozen=True)
class NamelessRefine:
    """Trimmed ICP that keeps a fixed share of the source's points (Chetverikov et al. 2005).

    Parameters
    ----------
    share : float
        Of the source's points, those nearest to the target, that count.
    max_iterations : int
        It stops earlier where the pairs stay the same.
    """

    share: float = 0.5
    max_iterations: int = 100

    def __post_init__(self) -> None:
        if not 0 < self.share <= 1:
            raise InputError(f"refine.share: expected a share in (0, 1], got {self.share}")
        check_positive("refine", max_iterations=self.max_iterations)

    def __call__(self, source: View, target: View, T_init: Array) -> Registration:
        """Fit a source to a target, beginning at the pose `T_init` (4, 4).

        Returns
        -------
        Registration
            The pose ``T_target_source``, and the pairs of points that it rests on, nearest first.
        """
        kept = max(1, round(self.share * len(source.points)))
        pose, before, converged, iteration = T_init, None, False, 0
        for iteration in range(1, self.max_iterations + 1):
            distances, partners = nearest(target.tree, se3.apply(pose, source.points))
            chosen = np.argsort(distances, kind="stable")[:kept]
            pairs = np.stack([chosen, partners[chosen]], axis=1)
            converged = before is not None and np.array_equal(pairs, before)
            if converged:
                break
            before = pairs
            if iteration < self.max_iterations:
                pose = se3.fit(source.points[pairs[:, 0]], target.points[pairs[:, 1]])
        lengths = distances[chosen]
        mse = float((lengths**2).mean())
        return Registration(
            source=source.name, target=target.name, T_target_source=pose,
            overlap=kept / len(source.points), trimmed_mse=mse, objective=mse, pairs=pairs,
            distances=lengths, trim_distance=float(lengths[-1]), iterations=iteration,
            converged=converged,
        )  # fmt: skip
