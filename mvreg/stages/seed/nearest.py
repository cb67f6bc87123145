"""Seed matches: what the descriptors alone propose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels.descriptor_matches import Rows
from mvreg.parallel import in_threads, slices
from mvreg.types import Matches, View

#: So many descriptors are worth a thread's while.
PART = 100


@dataclass(frozen=True)
class NearestSeed:
    """Each source keypoint with its nearest target descriptor; the best share of them is kept.

    Parameters
    ----------
    top_fraction : float
        The paper's delta: this share of the source keypoints, those with the smallest descriptor
        distances, become seeds (Sec. 3.2). 1 tries every keypoint, as OCPRA and OCPMA do.
    """

    top_fraction: float = 0.3

    def __post_init__(self) -> None:
        if not 0 < self.top_fraction <= 1:
            raise InputError(
                f"seed.top_fraction: expected a share in (0, 1], got {self.top_fraction}"
            )

    def __call__(self, source: View, target: View) -> Matches:
        own, other = source.features.descriptors, target.features.descriptors
        if len(own) == 0 or len(other) == 0:
            return Matches(np.empty((0, 2), dtype=np.intp), np.empty(0))
        rows = Rows(other)
        parts = in_threads(lambda some: rows.nearest(own[some]), slices(len(own), PART))
        distances, nearest = (np.concatenate(each) for each in zip(*parts, strict=True))
        best = np.argsort(distances, kind="stable")
        best = best[: int(np.ceil(self.top_fraction * len(own)))]
        return Matches(np.stack([best, nearest[best]], axis=1), distances[best])
