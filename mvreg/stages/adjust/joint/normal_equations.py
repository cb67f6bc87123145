"""The normal equations of all poses: sparse, robust, with the gauge fixed at the reference."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mvreg.kernels import normal_equations as kernel
from mvreg.kernels import way_sums
from mvreg.kernels.patches import Patches
from mvreg.kernels.results import NormalEquations
from mvreg.stages.adjust.joint.block_matrix import between_poses, solver
from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.rows import Residuals, Rows
from mvreg.stages.adjust.joint.trust import Trust
from mvreg.types import Array, Indices

#: The median of absolute residuals, times this, is the standard deviation of Gaussian ones.
MAD = 1.4826
#: Levenberg's damping, of the mean diagonal: picks the smallest step where nothing holds a pose,
#: as on a plane, and is too little to slow down anything that is held.
DAMPING = 1e-7


def summed(
    patches: Sequence[Patches], motions: Array, tile: Contacts, trust: Trust, frame: Frame,
    flat: bool, width: float,
) -> NormalEquations:  # fmt: skip
    """The normal equations of each way of a tile: of plain arrays, for any worker to find."""
    return way_sums.normal_equations(
        patches, motions, tile.ways, tile.ends, tile.samples, tile.patches, trust.begin,
        trust.cells, trust.fits, frame.centre, frame.radius, flat, width,
    )  # fmt: skip


def spread(residuals: Array) -> float:
    """A robust standard deviation of the residuals, from their median absolute value."""
    sizes = np.abs(residuals)
    half = len(sizes) // 2
    sizes.partition(half)  # `np.median` takes three times as long
    below = sizes[half] if len(sizes) % 2 else sizes[:half].max()
    return MAD * float(below + sizes[half]) / 2


def weight(residuals: Array, width: float) -> Array:
    """Weights (M,) of Tukey's biweight in iterated least squares, ``(1 - u^2)^2``.

    ``u`` is the residual in kernel widths; beyond one there is no weight (Beaton and Tukey 1974).
    """
    square = (residuals / width) ** 2
    weights: Array = np.where(square < 1, (1 - square) ** 2, 0.0)
    return weights


def curvature(residuals: Array, width: float) -> Array:
    """Second derivatives (M,) of the kernel, ``(1 - u^2) (1 - 5 u^2)``, as for `weight`."""
    square = (residuals / width) ** 2
    bent: Array = np.where(square < 1, (1 - square) * (1 - 5 * square), 0.0)
    return bent


@dataclass(frozen=True, eq=False)
class System:
    """Normal equations ``normal @ unknowns = -gradient`` over the poses that are free.

    `normal` is (6 F, 6 F), laid out as in `block_matrix`; `place` (N,) is where each scan is among
    the free ones, -1 for one that is not.
    """

    normal: Any
    gradient: Array
    place: Indices

    @classmethod
    def of(cls, found: Rows | Residuals, free: Sequence[int], width: float) -> System:
        """Sum over all rows, each with its weight and the kernel's."""
        sums = found.in_tiles(
            lambda tile: kernel.normal_equations(
                tile.jacobian, tile.residuals, tile.weights, tile.contacts.ends, width
            )
        )
        return cls.assembled(found.contacts.ways, sums, free)

    @classmethod
    def assembled(
        cls, ways: Indices, sums: Sequence[NormalEquations], free: Sequence[int]
    ) -> System:
        """Of what the ways (W, 2) come to, those of one tile after those of another."""
        blocks = np.concatenate([part.normals for part in sums])
        slopes = np.concatenate([part.gradients for part in sums])
        place = np.full(ways.max() + 1, -1)
        place[free] = np.arange(len(free))
        source, target = place[ways].T
        here, there = source >= 0, target >= 0
        gradient = np.zeros((len(free), 6))
        np.add.at(gradient, source[here], slopes[here])
        np.subtract.at(gradient, target[there], slopes[there])
        return cls(between_poses(blocks, source, target, len(free)), gradient.ravel(), place)

    def solver(self) -> Callable[[Array], Array]:
        """A solver of the damped equations for right-hand sides (6 F,) or (6 F, r)."""
        return solver(self.normal, DAMPING)

    def step(self) -> Array:
        """The unknowns (F, 6)."""
        found: Array = -self.solver()(self.gradient).reshape(-1, 6)
        return found
