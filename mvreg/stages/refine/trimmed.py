"""Refine a coarse pose by closest points: ICP, TrICP and fractional ICP, trimmed exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError
from mvreg.kernels import icp
from mvreg.parallel import spare
from mvreg.types import Array, Indices, Registration, View

#: How far neighbours are looked for at first, and at least, in units of the keypoints' spacing.
WIDEST, NARROWEST = 4.0, 1e-9


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


@dataclass(frozen=True)
class TrimmedICP:
    """Trimmed ICP: pairs, overlap and motion in turn, each solved exactly, so psi never grows.

    Each step goes where the last few lead to (Anderson acceleration, after Zhang, Yao and Deng,
    PAMI 2022), unless that makes psi larger: half the steps.

    Minimises ``psi = trimmed_mse / overlap^(1 + exponent)``, Eqs. (3) to (5) of the paper; after
    Chetverikov et al. 2005, and Phillips et al. 2007 for the exponent.

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
