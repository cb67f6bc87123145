"""Judge whether a registration can be relied on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from mvreg import se3
from mvreg.types import Registration, Verdict, View


class Units(Enum):
    """The unit of length in which Eq. (7) compares a squared length with a length."""

    resolution = "resolution"
    given = "given"


@dataclass(frozen=True)
class TmseJudge:
    """Eqs. (6) and (7): reliable if ``TMSE <= max(2 d_Q, 1.5 m_TMSE)``.

    d_Q is the target's resolution and m_TMSE the mean over the accepted registrations. Eq. (7)
    compares mm^2 with mm, so it depends on the unit. ``units=given`` reads the numbers as they
    are, which is the paper's only for scans in millimetres; ``units=resolution`` reads the equation
    in the unit that makes the mean resolution of the down-sampled scans 1.4, as it is for the
    Bunny in millimetres: the same test there, and free of units everywhere.

    Parameters
    ----------
    resolution_factor, mean_factor : float
        2 and 1.5 in Eq. (7).
    units : Units
        In which unit Eq. (7) is read.
    reference_resolution : float
        For ``units=resolution``.
    """

    resolution_factor: float = 2.0
    mean_factor: float = 1.5
    units: Units = Units.resolution
    reference_resolution: float = 1.4

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        accepted: Sequence[Registration],
    ) -> Verdict:
        unit = 1.0
        if self.units is Units.resolution:
            unit = source.scale.resolution / self.reference_resolution or 1.0
        threshold = self.resolution_factor * target.resolution * unit
        if accepted:
            mean = float(np.mean([a.trimmed_mse for a in accepted]))
            threshold = max(threshold, self.mean_factor * mean)  # Eq. (7)
        reliable = registration.trimmed_mse <= threshold
        reason = f"trimmed MSE {'within' if reliable else 'above'} Eq. (7)"
        return Verdict(reliable, registration.trimmed_mse, threshold, reason)


@dataclass(frozen=True)
class PointToPlaneJudge:
    """Reliable if the trimmed pairs lie in each other's tangent planes and their normals agree.

    The root mean square point-to-plane distance over the trimmed pairs, in units of the scans'
    resolution, tells right from wrong far better than the trimmed MSE, which is mostly sampling.

    Parameters
    ----------
    max_residual : float
        In units of the mean resolution of the down-sampled scans.
    min_agreement : float
        Smallest mean cosine between paired normals.
    """

    max_residual: float = 0.6
    min_agreement: float = 0.8

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        accepted: Sequence[Registration],
    ) -> Verdict:
        moved, stay = registration.pairs.T
        transform = registration.T_target_source
        gaps = se3.apply(transform, source.points[moved]) - target.points[stay]
        normals = source.normals[moved] @ transform[:3, :3].T
        cosine = (normals * target.normals[stay]).sum(axis=1)
        if not (source.features.oriented and target.features.oriented):
            cosine = np.abs(cosine)
        residual = float(np.sqrt(((gaps * target.normals[stay]).sum(axis=1) ** 2).mean()))
        score = residual / (source.scale.resolution or 1.0)
        if score > self.max_residual:
            return Verdict(False, score, self.max_residual, "point-to-plane residual too large")
        if cosine.mean() < self.min_agreement:
            return Verdict(False, score, self.max_residual, "normals disagree")
        return Verdict(True, score, self.max_residual, "residual small and normals agree")
