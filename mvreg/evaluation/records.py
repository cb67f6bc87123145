"""Records of an assessment: one per placed scan, one per pair in contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mvreg.evaluation.grade import Grade
from mvreg.geometry import se3
from mvreg.types import Array

#: Times the standard deviation, 95 of 100 values of a normal distribution.
TIMES_95 = 1.959964


@dataclass(frozen=True)
class Uncertainty:
    """How far a pose may be off in the right place: `rotation` (degrees), `translation` (length).

    Root mean squares over all directions, from `Result.covariances`; of the translation that of
    the scan's own middle. `axes_95` is half the width of the middle's 95 per cent interval along
    each axis of the model frame (length). It says nothing of poses that are wrong altogether.
    """

    rotation: float
    translation: float
    axes_95: tuple[float, float, float]

    @classmethod
    def of(cls, covariance: Array, pose: Array, points: Array) -> Uncertainty:
        """The uncertainty of a pose from its covariance.

        Parameters
        ----------
        covariance : (6, 6) array
            Of the twist in ``exp(twist) @ T_model_scan``, rotation (radians) before translation.
        pose : (4, 4) array
            ``T_model_scan``.
        points : (N, 3) array
            Of the scan, in its frame.
        """
        middle = se3.apply(pose, points.mean(axis=0))
        # A small twist (w, v) moves the middle c by v + w x c.
        jacobian = np.hstack([-se3.skew(middle), np.eye(3)])
        rotation = np.trace(covariance[:3, :3])
        moved = np.maximum(np.diagonal(jacobian @ covariance @ jacobian.T), 0)
        x, y, z = (TIMES_95 * np.sqrt(moved)).tolist()
        turned = np.degrees(np.sqrt(max(rotation, 0.0)))
        return cls(float(turned), float(np.sqrt(moved.sum())), (x, y, z))


@dataclass(frozen=True)
class LinkAssessment:
    """Two placed scans that overlap.

    Parameters
    ----------
    source, target : str
    component : int
        The partial model that they belong to, 1 for the reference's.
    contact_ratio : float
        Share of the points of one that lie on the other; of the scan that is covered better.
    rms : float
        Root mean square point-to-plane distance there (length).
    confidence : float
        Probability that their relative pose is right, by what these two scans alone show.
    """

    source: str
    target: str
    component: int
    contact_ratio: float
    rms: float
    confidence: float


@dataclass(frozen=True)
class ScanAssessment:
    """One placed scan.

    Parameters
    ----------
    name : str
    component : int
        The partial model that it belongs to, 1 for the reference's.
    grade : Grade or None
        None for a scan that is alone in its partial model, and so in its own frame.
    confidence : float or None
        Probability that its pose is right, by all its neighbours together; None where it has none.
    reason : str
        The strongest objection to the pose, or that there is none.
    coverage : float
        Share of its points that lie on any other scan of the partial model.
    inlier_ratio : float or None
        Share of the distances of those points, point to plane, that are within the tolerance.
    rms : float or None
        Root mean square of these distances (length).
    strength : tuple of 3 floats
        How well the overlap holds the scan along each axis of its own frame, from 0, free to slide,
        to 1; see `axis_strength`.
    uncertainty : Uncertainty or None
        None where the result has no covariance of the pose.
    """

    name: str
    component: int
    grade: Grade | None
    confidence: float | None
    reason: str
    coverage: float
    inlier_ratio: float | None
    rms: float | None
    strength: tuple[float, float, float]
    uncertainty: Uncertainty | None = None


@dataclass(frozen=True)
class Assessment:
    """Every placed scan by name, the pairs of them that overlap, and the tolerance (length).

    `remarks` are sentences on the scans as a whole.
    """

    tolerance: float
    scans: Mapping[str, ScanAssessment]
    links: tuple[LinkAssessment, ...]
    remarks: tuple[str, ...] = ()
