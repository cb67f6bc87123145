"""Refine a coarse pose: ICP, and TrICP with its trimming solved exactly."""

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
        bound = 4 * source.scale.spacing
        transform, pairs, iterations, converged = self.iterate(source.points, target, T_init, bound)
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

    def iterate(
        self, points: Array, target: View, transform: Array, bound: float
    ) -> tuple[Array, Trim, int, bool]:
        """Pair, trim and fit `points` (N, 3) in turn, from `transform` until psi stands still.

        Returns the pose, the pairs that belong to it, the number of iterations and whether psi
        stood still.
        """
        previous = np.inf
        for iteration in range(self.max_iterations + 1):
            moved = se3.apply(transform, points)
            pairs = trimmed_pairs(target, moved, bound, self.min_overlap, self.exponent)
            if previous - pairs.objective <= self.tolerance * pairs.objective:
                return transform, pairs, iteration, True
            if iteration == self.max_iterations:
                break
            previous = pairs.objective
            # Shrinks slowly: where it must be widened, the whole query is done again.
            bound = max(2 * pairs.distances[-1], 0.9 * pairs.bound, 1e-9 * target.scale.spacing)
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
