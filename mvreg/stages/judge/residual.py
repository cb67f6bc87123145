"""Judge a registration by its residual: Eq. (7) of the paper, and point-to-plane criteria."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import Enum

import numpy as np

from mvreg.surface.fit import length_read_as_one, surface_fit, underconstrained
from mvreg.types import Registration, Verdict, View, ViewGraph


class Units(Enum):
    """The unit of length in which Eq. (7) compares a squared length with a length."""

    resolution = "resolution"
    given = "given"


class ResidualJudge(ABC):
    """A judge whose score is a residual: on few points it is about what it is on all."""

    @abstractmethod
    def __call__(
        self, registration: Registration, source: View, target: View, graph: ViewGraph
    ) -> Verdict:
        """Judge `registration`, see `mvreg.contracts.Judge`."""

    def rejected_early(
        self, registration: Registration, few: View, target: View, graph: ViewGraph, factor: float
    ) -> bool:
        """Whether a pose scores worse than `factor` thresholds on `few` of the points."""
        verdict = self(registration, few, target, graph)
        return not verdict.reliable and verdict.score > factor * verdict.threshold


@dataclass(frozen=True)
class TmseJudge(ResidualJudge):
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
    min_overlap : float
        Registrations that keep less of the source are not relied on. 0 is the paper's; `grow`
        lowers it level by level, so that the model is large before doubtful scans have their turn.
    units : Units
        In which unit Eq. (7) is read.
    reference_resolution : float
        For ``units=resolution``.
    """

    resolution_factor: float = 2.0
    mean_factor: float = 1.5
    min_overlap: float = 0.0
    units: Units = Units.resolution
    reference_resolution: float = 1.4

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> Verdict:
        unit = 1.0
        if self.units is Units.resolution:
            unit = length_read_as_one(source, self.reference_resolution)
        threshold = self.resolution_factor * target.resolution * unit
        if len(graph):
            mean = float(np.mean([edge.trimmed_mse for edge in graph]))
            threshold = max(threshold, self.mean_factor * mean)  # Eq. (7)
        score = registration.trimmed_mse
        if score > threshold:
            return Verdict(False, score, threshold, "trimmed MSE above Eq. (7)")
        if registration.overlap < self.min_overlap:
            return Verdict(False, score, threshold, f"overlap below {self.min_overlap:g}")
        return Verdict(True, score, threshold, "trimmed MSE within Eq. (7)")


@dataclass(frozen=True)
class PointToPlaneJudge(ResidualJudge):
    """Reliable if the trimmed pairs lie in each other's tangent planes and their normals agree.

    The point-to-plane residual tells right from wrong better than the trimmed MSE, which is mostly
    sampling: of the raw pairs of the Bunny and the Dragon the smallest wrong one has 0.89, nine in
    ten right ones of the Bunny have less than 0.46; wrong poses met while growing models of the
    Dragon began at 0.55, right ones ended at 0.46. ``experiments/calibration/judge.py`` repeats it.

    Parameters
    ----------
    max_residual : float
        In units of the mean resolution of the down-sampled scans.
    min_agreement : float
        Smallest mean cosine between paired normals.
    min_overlap : float
        As in `TmseJudge`.
    min_localizability : float
        Of the trimmed pairs, see `localizability`. Two caps of a sphere have 0.0003, pairs of the
        Bunny 0.02 and more.
    """

    max_residual: float = 0.5
    min_agreement: float = 0.8
    min_overlap: float = 0.0
    min_localizability: float = 0.003

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> Verdict:
        residual, agreement = surface_fit(registration, source, target)
        reason = "residual small and normals agree"
        if residual > self.max_residual:
            reason = "point-to-plane residual too large"
        elif agreement < self.min_agreement:
            reason = "normals disagree"
        elif weak := underconstrained(
            registration, source, target, self.min_overlap, self.min_localizability
        ):
            reason = weak
        else:
            return Verdict(True, residual, self.max_residual, reason)
        return Verdict(False, residual, self.max_residual, reason)


@dataclass(frozen=True)
class TmseSurfaceJudge(TmseJudge):
    """Eq. (7), and besides it the point-to-plane test.

    Eq. (7) alone lets wrong poses into the Dragon in some orders of its scans, with trimmed MSEs of
    1.55 against thresholds of 1.97: sampling hides them, but they do not lie in one surface. What
    Eq. (7) refuses stays refused.

    Parameters
    ----------
    resolution_factor, mean_factor, min_overlap, units, reference_resolution
        As in `TmseJudge`.
    max_residual, min_agreement, min_localizability : float
        As in `PointToPlaneJudge`.
    """

    max_residual: float = 0.5
    min_agreement: float = 0.8
    min_localizability: float = 0.003

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> Verdict:
        printed = super().__call__(registration, source, target, graph)
        surface = PointToPlaneJudge(
            self.max_residual, self.min_agreement, min_localizability=self.min_localizability
        )
        verdict = surface(registration, source, target, graph)
        if not printed.reliable or verdict.reliable:
            return printed
        return Verdict(False, printed.score, printed.threshold, verdict.reason)
