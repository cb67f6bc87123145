"""What the refinements by planes share: the search, its damped steps, and the best pose of all."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.refine.trimmed import NARROWEST, WIDEST, Trim, TrimmedICP
from mvreg.types import Array, View

#: Levenberg's damping, in units of the mean eigenvalue of the normal equations. Where nothing holds
#: the source, as on a plane, it picks the smallest step, and keeps noise from making it slide.
DAMPING = 1e-3
#: The search ends after so many iterations in a row that got no nearer. One is too few: of 18 pairs
#: of synthetic scans 30 degrees off, two more stopped too early.
PATIENCE = 3


@dataclass(frozen=True, eq=False)
class PlanePairs:
    """Trimmed pairs under one pose, in the target's frame.

    `moved` and `partners` (P, 3) are the source's and the target's points, `directions` (P, R, 3)
    those along which the gaps between them count; the objective of `trim` is psi of such residuals.
    """

    trim: Trim
    moved: Array
    partners: Array
    directions: Array


def smallest_step(points: Array, gaps: Array, directions: Array, longest: float) -> Array:
    """The small motion that closes the gaps best, as far as they count.

    Solves ``min sum ((gap + w x p + t) . d)^2`` for a turn w about the origin and a shift t, by
    damped least squares: where there are many solutions it is the smallest.

    Parameters
    ----------
    points : (P, 3) array
        Where the gaps are, about their centre (length).
    gaps : (P, 3) array
        From the target to the source (length).
    directions : (P, R, 3) array
        Along which gaps count; their lengths are weights.
    longest : float
        The root mean square of the points' motion is at most this (length).

    Returns
    -------
    (6,) array
        w (radians) and t (length); zero where nothing counts.
    """
    radius = np.sqrt((points**2).sum(axis=1).mean()) or 1.0
    turning = np.cross(points[:, None] / radius, directions)
    jacobian = np.concatenate([turning, directions], axis=2).reshape(-1, 6)
    residuals = (directions @ gaps[:, :, None]).reshape(-1)
    normal = jacobian.T @ jacobian
    damping = DAMPING * np.trace(normal) / 6
    if damping == 0:
        return np.zeros(6)
    step: Array = -np.linalg.solve(normal + damping * np.eye(6), jacobian.T @ residuals)
    length = float(np.linalg.norm(step))
    if length > longest:
        step *= longest / length
    step[:3] /= radius
    return step


@dataclass(frozen=True)
class PlaneICP(TrimmedICP, ABC):
    """What the refinements by planes have in common; see `refine_planes.PointToPlane`.

    Pairs and overlap are those of TrICP, Eq. (4), for distances between points: planes are
    endless, and cannot tell where the overlap ends. Minimised is
    ``psi = mean squared residual / overlap^(1 + exponent)`` (length^2), of which the same pose has
    less the better it fits, so that candidates can be compared. New pairs may have larger
    residuals: the pose returned is the best one seen, the first included.
    """

    @abstractmethod
    def directions(self, facing: Array, normals: Array) -> Array:
        """Along which gaps count (P, R, 3), given the unit normals of both sides (P, 3).

        A squared residual is the sum of a gap's squared components along them.
        """

    def iterate(
        self, source: View, target: View, transform: Array
    ) -> tuple[Array, Trim, int, bool]:
        """Pair, trim and step in turn, from `transform` until psi gets no smaller."""
        spacing = source.scale.spacing
        bound, waited = WIDEST * spacing, 0
        best = self.measure(source, target, transform, bound)
        pose, pairs = transform, best
        for iteration in range(1, self.max_iterations + 1):
            bound = pairs.trim.next_bound(NARROWEST * spacing)
            transform = self.motion(pairs, spacing) @ transform
            pairs = self.measure(source, target, transform, bound)
            least = best.trim.objective
            waited = 0 if pairs.trim.objective < (1 - self.tolerance) * least else waited + 1
            if pairs.trim.objective < least:
                pose, best = transform, pairs
            if waited == PATIENCE:
                return pose, best.trim, iteration, True
        return pose, best.trim, self.max_iterations, False

    def trim(self, source: View, target: View, transform: Array, bound: float) -> Trim:
        """The trimmed pairs of a pose, with psi of the residuals as their objective."""
        return self.measure(source, target, transform, bound).trim

    def measure(self, source: View, target: View, transform: Array, bound: float) -> PlanePairs:
        """The trimmed pairs of a pose, with psi as their objective."""
        points = se3.apply(transform, source.points)
        trim = super().trim(source, target, transform, bound)
        moved, partners = points[trim.chosen], target.points[trim.targets]
        facing = source.normals[trim.chosen] @ transform[:3, :3].T
        directions = self.directions(facing, target.normals[trim.targets])
        residuals = directions @ (moved - partners)[:, :, None]
        overlap = len(moved) / len(points)
        objective = float((residuals**2).sum()) / len(moved) / overlap ** (1 + self.exponent)
        return PlanePairs(replace(trim, objective=objective), moved, partners, directions)

    def motion(self, pairs: PlanePairs, longest: float) -> Array:
        """The next step (4, 4): one of Gauss-Newton, that moves points by `longest` at most."""
        centre = pairs.moved.mean(axis=0)
        gaps = pairs.moved - pairs.partners
        return se3.about(
            centre, se3.exp(smallest_step(pairs.moved - centre, gaps, pairs.directions, longest))
        )
