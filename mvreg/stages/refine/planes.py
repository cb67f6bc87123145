"""Refine a coarse pose by planes: point-to-plane, symmetric and plane-to-plane (generalised) ICP.

All pair and trim as TrICP does, by the distances between points. They differ in what they minimise
then: of the gap of each pair only what leads out of the surface counts, so that points may slide
along it. That takes out the sampling, which is most of the error between range scans, and needs
a sixth of TrICP's iterations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.kernels import icp
from mvreg.parallel import spare
from mvreg.stages.refine.plane_base import PlaneICP, PlanePairs, smallest_step
from mvreg.stages.refine.trimmed import NARROWEST, WIDEST, Trim
from mvreg.types import Array, View


@dataclass(frozen=True)
class PointToPlane(PlaneICP):
    """Point-to-plane ICP (Chen and Medioni 1992), trimmed as TrICP is.

    A pair's residual is the distance of the source point to the target point's tangent plane. A
    step solves the small-angle equations (Low 2004), damped, and moves points no farther than the
    keypoints' spacing. Signs of normals do not matter.

    Parameters
    ----------
    exponent, min_overlap : float
        The paper's lambda and the smallest overlap considered, as in `TrimmedICP`.
    max_iterations : int
        As in `TrimmedICP`; a tenth of it is usual.
    tolerance : float
        Stop when psi gets no smaller than by this share of itself, three times in a row.
    """

    def directions(self, facing: Array, normals: Array) -> Array:
        """The target's normals."""
        return normals[:, None]

    def iterate(
        self, source: View, target: View, transform: Array
    ) -> tuple[Array, Trim, int, bool]:
        """As the other refinements by planes, all in one kernel."""
        spacing = source.scale.spacing
        pose, pairs, iterations, converged = icp.plane_icp(
            target.tree, target.normals, source.points, transform, WIDEST * spacing,
            NARROWEST * spacing, self.min_overlap, self.exponent, self.max_iterations,
            self.tolerance, spacing, spare(),
        )  # fmt: skip
        return pose, Trim(*pairs), iterations, converged


@dataclass(frozen=True)
class SymmetricICP(PlaneICP):
    """Symmetric ICP (Rusinkiewicz 2019), trimmed as TrICP is.

    A pair's residual is its gap along the mean of both normals: zero wherever both points lie on
    one surface of second order. Source and target are turned half the way each, and the
    linearisation is exact in the tangent of the half angle. In each pair the source's normal is
    first turned to the target's side, so that unknown signs do no harm, and opposed normals do
    not cancel to a residual of zero.

    Parameters
    ----------
    exponent, min_overlap, max_iterations, tolerance
        As in `PointToPlane`.
    """

    def directions(self, facing: Array, normals: Array) -> Array:
        """The means of the normals, which lie on one side."""
        opposed = (facing * normals).sum(axis=1, keepdims=True) < 0
        mean: Array = (np.where(opposed, -facing, facing) + normals)[:, None] / 2
        return mean

    def motion(self, pairs: PlanePairs, longest: float) -> Array:
        """The next step (4, 4): half a turn, the shift, and the other half (his Section 3)."""
        middle = (pairs.moved + pairs.partners) / 2
        centre = middle.mean(axis=0)
        gaps = pairs.moved - pairs.partners
        step = smallest_step(middle - centre, gaps, pairs.directions, longest)
        tangent = float(np.linalg.norm(step[:3])) / 2
        angle = np.arctan(tangent)  # of half the turn
        half = se3.exp(np.append(step[:3] / 2 * (angle / (tangent or 1.0)), np.zeros(3)))
        shift = se3.from_parts(np.eye(3), step[3:] * np.cos(angle))
        return se3.about(centre, half @ shift @ half)


@dataclass(frozen=True)
class GeneralizedICP(PlaneICP):
    """Generalised ICP (Segal, Haehnel and Thrun 2009), plane to plane, trimmed as TrICP is.

    Every point stands for a disc along its surface, of covariance 1 along it and `epsilon` across.
    A squared residual is a gap's Mahalanobis distance, times ``2 epsilon``, so that across parallel
    discs it is the squared length, and along them a small share of it; discs at an angle hardly
    count. Signs of normals do not matter.

    Parameters
    ----------
    exponent, min_overlap, max_iterations, tolerance
        As in `PointToPlane`.
    epsilon : float
        0.001 in the authors' published code, PCL and Open3D.
    """

    epsilon: float = 1e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.epsilon <= 1:
            raise InputError(f"refine.epsilon: expected a share in (0, 1], got {self.epsilon}")

    def directions(self, facing: Array, normals: Array) -> Array:
        """A square root of the inverse of both covariances' sum."""
        flat = 1 - self.epsilon
        sides = np.stack([facing, normals], axis=1)
        covariance = 2 * np.eye(3) - flat * np.swapaxes(sides, 1, 2) @ sides
        weight = 2 * self.epsilon * np.linalg.inv(covariance)
        root: Array = np.swapaxes(np.linalg.cholesky(weight), 1, 2)
        return root
