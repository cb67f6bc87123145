"""Refine a coarse pose by closest points: ICP, TrICP and fractional ICP, trimmed exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.errors import InputError
from mvreg.nearest import nearest
from mvreg.types import Array, Indices, Registration, View


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


def trim(distances: Array, min_overlap: float, exponent: float) -> tuple[int, float]:
    """How many of the ascending `distances` (N,) to keep, and the objective psi (length^2).

    For a fixed number of pairs the sum of squares is smallest over the smallest distances, so the
    best subset is a prefix of the sorted list: one cumulative sum finds it exactly.
    """
    size = len(distances)
    count = np.arange(1, size + 1)
    psi = np.cumsum(distances**2) / count * (size / count) ** (1 + exponent)  # Eq. (3), (4)
    first = max(int(np.ceil(min_overlap * size)), 1) - 1
    best = first + int(psi[first:].argmin())
    return best + 1, float(psi[best])


def trimmed_pairs(
    target: View, moved: Array, bound: float, min_overlap: float, exponent: float
) -> Trim:
    """Nearest neighbours of `moved` (N, 3) in the target, trimmed; exact for any `bound` > 0.

    A point without a neighbour within the bound is at least that far away. If the best prefix holds
    under that lower bound without such a point, it holds for the true distances; else the bound is
    widened.
    """
    while True:
        distances, indices = nearest(target.tree, moved, bound)
        order = np.argsort(distances, kind="stable")
        ascending = np.minimum(distances[order], bound)
        keep, objective = trim(ascending, min_overlap, exponent)
        found = np.searchsorted(distances[order], np.inf)
        if keep <= found or found == len(moved):
            chosen = order[:keep]
            return Trim(chosen, indices[chosen], ascending[:keep], objective, bound)
        bound *= 2


@dataclass(frozen=True)
class TrimmedICP:
    """Trimmed ICP: pairs, overlap and motion in turn, each solved exactly, so psi never grows.

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
        Stop when psi changes by less than this share of itself: the published code's 1e-6 mm^2
        without the unit.
    """

    exponent: float = 2.0
    min_overlap: float = 0.4
    max_iterations: int = 100
    tolerance: float = 1e-6

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

    def pair(self, target: View, moved: Array, bound: float) -> Trim:
        """Pair `moved` (N, 3) with the target's points; see `trimmed_pairs`."""
        return trimmed_pairs(target, moved, bound, self.min_overlap, self.exponent)

    def iterate(
        self, source: View, target: View, transform: Array
    ) -> tuple[Array, Trim, int, bool]:
        """Pair, trim and fit the source in turn, from `transform` until psi stands still.

        Returns the pose, the pairs that belong to it, the number of iterations and whether psi
        stood still.
        """
        points, spacing, previous = source.points, source.scale.spacing, np.inf
        bound = 4 * spacing
        for iteration in range(self.max_iterations + 1):
            pairs = self.pair(target, se3.apply(transform, points), bound)
            if previous - pairs.objective <= self.tolerance * pairs.objective:
                return transform, pairs, iteration, True
            if iteration == self.max_iterations:
                break
            previous, bound = pairs.objective, pairs.next_bound(1e-9 * spacing)
            transform = se3.fit(points[pairs.chosen], target.points[pairs.targets])  # Eq. (5)
        return transform, pairs, iteration, False


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

    def pair(self, target: View, moved: Array, bound: float) -> Trim:
        """Pair `moved` (N, 3) with the target's points, trimmed to the least FRMSD."""
        return trimmed_pairs(target, moved, bound, self.min_overlap, 2 * self.exponent - 1)
