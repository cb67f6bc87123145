"""Scales of scans, estimated along with their poses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.stages.adjust.joint.block_matrix import solver
from mvreg.stages.adjust.joint.clusters import RIDGE
from mvreg.stages.adjust.joint.covariance import CLASSES
from mvreg.stages.adjust.joint.extended import ALL, BEND, SCALE, Extended
from mvreg.stages.adjust.joint.patterns import PRIOR, priors, scatter
from mvreg.stages.adjust.joint.rows import Rows
from mvreg.types import Array, Indices, PoseScatter, Scan, ScanScale, View

#: Scales are estimated in so many refinements at most, the poses of one being the start of the
#: next, and are at rest once none moves by more than this share of its standard deviation.
REFINEMENTS, RESTED = 8, 0.05
#: Scans of one model whose scales are estimated, at most: the system of all unknowns is dense.
MOST = 300
#: A scale is not told, and stays as it is, if its standard deviation is above this share of what it
#: is before anything is seen: normals are noise there, and seem to tell it.
UNTOLD = 0.1


@dataclass(frozen=True, eq=False)
class Oversize:
    """How much too large scans are found to be, as shares, beside the scale that they were given.

    Parameters
    ----------
    steps : (N,) array
    covariance : (N, N) array
    coupling : (F, 6, N) array
        How much of what holds the free poses each scale takes part in.
    """

    steps: Array
    covariance: Array
    coupling: Array

    @property
    def deviations(self) -> Array:
        """(N,): standard deviations."""
        return np.sqrt(np.maximum(self.covariance.diagonal(), 0.0))

    def loosened(self, scatter: PoseScatter) -> PoseScatter:
        """The poses' scatter with what they owe to scales that are not known for certain."""
        values, vectors = np.linalg.eigh(self.covariance)
        modes = self.coupling @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        return replace(scatter, modes=np.concatenate([scatter.modes, modes], axis=2))


def oversize(
    extended: Extended, free: Sequence[int], held: Sequence[int], width: float, size: float,
    graded: Sequence[tuple[Callable[[Rows], Indices], float]], given: Array,
) -> Oversize:  # fmt: skip
    """One step of Gauss-Newton in all poses and scales.

    Parameters
    ----------
    extended : Extended
    free, held : sequences of int
        Scans whose poses are free, and those whose poses are not. Of one that is held, scales are
        beside their mean, which nothing tells; the distances of several tell it.
    width : float
        Of the kernel, in units of the residuals.
    size : float
        Variance of the residuals in their units.
    graded : sequence of callable and float
        Classes of residuals, see `pose_scatter`, and what the poses take out of their sums.
    given : (N,) array
        Logarithms of what scans have been made smaller by. They are 0 before anything is seen, to
        `PRIOR`.
    """
    count = len(extended.shapes)
    sums = extended.sums(np.zeros((count, ALL)), width, [groups for groups, _ in graded])
    prior = priors(sums.normal, held, size)
    gradient = sums.gradient.copy()
    gradient[:, SCALE] -= prior[:, SCALE] * given
    prior[:, BEND] = 1.0
    normal = sums.normal.reshape(count, ALL, count, ALL).copy()
    left = np.repeat([1 - lost for _, lost in graded], CLASSES)
    modes = sums.modes / np.sqrt(np.maximum(left, RIDGE))[:, None, None]
    normal[:, BEND], normal[:, :, :, BEND], gradient[:, BEND], modes[:, :, BEND] = 0, 0, 0, 0
    solve = solver(normal.reshape(count * ALL, -1) + np.diag(prior.ravel()), 0.0)
    steps = solve(gradient.ravel()).reshape(count, ALL)[:, SCALE]
    covariance = scatter(solve, size, modes)[:, SCALE, :, SCALE]
    if len(held) == 1:
        beside = np.eye(count) - 1 / count
        steps, covariance = beside @ steps, beside @ covariance @ beside
    steps = np.where(covariance.diagonal() < (UNTOLD * PRIOR) ** 2, steps, 0.0)
    return Oversize(steps, covariance, normal[list(free)][:, :6, :, SCALE])


def smaller(view: View, given: float) -> View:
    """The view, made smaller about the middle of its points by a factor with this logarithm.

    Not about the origin of its frame, which may be that of a map; nor about its sensor: far from
    it the pose would owe more to the scale than `loosened` says.
    """
    if not given:
        return view
    factor, scan = float(np.exp(-given)), view.scan
    centre = (view if scan is None else scan).points.mean(axis=0)

    def made(points: Array) -> Array:
        moved: Array = centre + factor * (points - centre)
        return moved

    if scan is not None:
        seen_from = None if scan.view_point is None else made(scan.view_point)
        scan = Scan(scan.name, made(scan.points), scan.view_direction, seen_from, scan.up)
    return replace(view, points=made(view.points), scan=scan)


def told(names: Sequence[str], given: Array, found: Oversize) -> tuple[ScanScale, ...]:
    """The scales as records."""
    return tuple(
        ScanScale(name, float(np.exp(-one)), float(deviation))
        for name, one, deviation in zip(names, given, found.deviations, strict=True)
    )
