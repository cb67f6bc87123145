"""Refine a coarse pose by closest points: ICP, TrICP and fractional ICP, trimmed exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.geometry.vertical import levelled, tilt
from mvreg.kernels import icp
from mvreg.kernels.trimmed_pairs import trimmed
from mvreg.parallel import spare
from mvreg.types import Array, Indices, Registration, View

#: How far neighbours are looked for at first, and at least, in units of the keypoints' spacing.
WIDEST, NARROWEST = 4.0, 1e-9
#: Poses of levelled scans tilt by so much at most (degrees): what a bubble level, or a car, is off.
MOST_TILT = 3.0


@dataclass(frozen=True, eq=False)
class Trim:
    """The best overlap for fixed pairs, Eq. (4), solved exactly.

    `chosen` (P,) are the source points kept, nearest first, `targets` (P,) their partners,
    `distances` (P,) how far they are, `objective` the minimum psi; `bound` is how far neighbours
    had to be looked for.
    """

    chosen: Indices
    targets: Indices
    distances: Array
    objective: float
    bound: float

    def next_bound(self, least: float) -> float:
        """How far to look for neighbours in the next iteration; `least` is positive (length)."""
        # Shrinks slowly: where it must be widened, the whole query is done again.
        return max(2 * float(self.distances[-1]), 0.9 * self.bound, least)


def tilts(transform: Array, source: View, target: View) -> bool:
    """Whether a pose tilts more than levelled scans may; False where a vertical is unknown."""
    up, other = source.up, target.up
    return up is not None and other is not None and bool(tilt(transform, up, other) > MOST_TILT)


def level_enough(transform: Array, source: View, target: View) -> Array:
    """The nearest pose that tilts no more, about the middle of the source."""
    assert source.up is not None and target.up is not None
    return levelled(transform, source.up, target.up, source.points.mean(axis=0), MOST_TILT)


@dataclass(frozen=True)
class TrimmedICP:
    """Trimmed ICP: pairs, overlap and motion in turn, each solved exactly, so psi never grows.

    Each step goes where the last few lead to (Anderson acceleration, after Zhang, Yao and Deng,
    PAMI 2022), unless that makes psi larger: half the steps.

    Minimises ``psi = trimmed_mse / overlap^(1 + exponent)``, Eqs. (3) to (5) of the paper; after
    Chetverikov et al. 2005, and Phillips et al. 2007 for the exponent.

    Between views whose verticals are known, a pose that tilts by more than `MOST_TILT` is turned
    back to that, whatever refines it; pairs and objective are those of the pose returned.

    Parameters
    ----------
    exponent : float
        The paper's lambda.
    min_overlap : float
        Smallest overlap considered; 0.4 in the authors' published code.
    max_iterations : int
        The published code's 100.
    tolerance : float
        Stop when psi changes by less than this share of itself. The published code's 1e-6 mm^2
        makes no difference to the errors, and takes twice the time where a scan does not fit.
    """

    exponent: float = 2.0
    min_overlap: float = 0.4
    max_iterations: int = 100
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        if self.max_iterations < 0:
            raise InputError(
                f"refine.max_iterations: expected 0 or more, got {self.max_iterations}"
            )
        if not 0 < self.min_overlap <= 1:
            raise InputError(
                f"refine.min_overlap: expected a share in (0, 1], got {self.min_overlap}"
            )

    def __call__(self, source: View, target: View, T_init: Array) -> Registration:
        transform, pairs, iterations, converged = self.iterate(source, target, T_init)
        if tilts(transform, source, target):
            transform = level_enough(transform, source, target)
            pairs = self.trim(source, target, transform, WIDEST * source.scale.spacing)
        return Registration(
            source=source.name,
            target=target.name,
            T_target_source=transform,
            overlap=len(pairs.chosen) / len(source.points),
            trimmed_mse=float((pairs.distances**2).mean()),
            objective=pairs.objective,
            pairs=np.stack([pairs.chosen, pairs.targets], axis=1),
            distances=pairs.distances,
            trim_distance=float(pairs.distances[-1]),
            iterations=iterations,
            converged=converged,
        )

    def trim(self, source: View, target: View, transform: Array, bound: float) -> Trim:
        """The trimmed pairs of a pose; `bound` is how far neighbours are looked for at first."""
        points = se3.apply(transform, source.points)
        return Trim(*trimmed(target.tree, points, bound, self.min_overlap, self.power))

    @property
    def power(self) -> float:
        """Of the overlap, by which a mean squared distance is divided."""
        return 1 + self.exponent

    def iterate(
        self, source: View, target: View, transform: Array
    ) -> tuple[Array, Trim, int, bool]:
        """Pair, trim and fit the source in turn, from `transform` until psi stands still.

        Returns the pose, the pairs that belong to it, the number of iterations and whether psi
        stood still.
        """
        spacing = source.scale.spacing
        pose, pairs, iterations, converged = icp.trimmed_icp(
            target.tree, source.points, transform, WIDEST * spacing, NARROWEST * spacing,
            self.min_overlap, self.power, self.max_iterations, self.tolerance, spare(),
        )  # fmt: skip
        return pose, Trim(*pairs), iterations, converged


@dataclass(frozen=True)
class ICP(TrimmedICP):
    """Plain ICP (Besl and McKay 1992): every source point counts, whatever the overlap.

    For comparison; partial overlap biases it. Its parameters are those of `TrimmedICP`, with the
    overlap held at 1.
    """

    exponent: float = 0.0
    min_overlap: float = 1.0


@dataclass(frozen=True)
class FractionalICP(TrimmedICP):
    """Fractional ICP (Phillips, Liu and Tomasi 2007): minimise the fractional RMSD.

    ``FRMSD = trimmed_rmse / overlap^exponent``, over pairs, overlap and motion in turn, each solved
    exactly. It is TrICP with another exponent and without a known overlap, because a square root
    changes no minimum; `Registration.objective` is FRMSD^2 (length^2), ``2 exponent = 1 + lambda``
    of the paper's psi. The smaller exponent trims more.

    Parameters
    ----------
    exponent : float
        The power of the overlap under the root mean square: the authors' 0.95 for three
        dimensions, as in PCL and libpointmatcher.
    min_overlap : float
        Smallest overlap considered. The authors have none; without one, a single pair that
        coincides would be the best of all subsets. 0.4 as in `TrimmedICP`.
    max_iterations, tolerance
        As in `TrimmedICP`.
    """

    exponent: float = 0.95

    @property
    def power(self) -> float:
        """Of the overlap: twice that of the root."""
        return 2 * self.exponent
