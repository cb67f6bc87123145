"""The normal equations of all poses: sparse, robust, with the gauge fixed at the reference."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mvreg.geometry import se3
from mvreg.kernels import normal_equations as kernel
from mvreg.kernels import residuals as residual_kernel
from mvreg.kernels import way_sums
from mvreg.kernels.patches import Patches
from mvreg.kernels.results import NormalEquations
from mvreg.parallel import Answer, in_threads, slices
from mvreg.stages.adjust.joint.block_matrix import between_poses, solver
from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.stages.adjust.joint.trust import Trust
from mvreg.types import Array, Indices

#: The median of absolute residuals, times this, is the standard deviation of Gaussian ones.
MAD = 1.4826
#: Levenberg's damping, of the mean diagonal: picks the smallest step where nothing holds a pose,
#: as on a plane, and is too little to slow down anything that is held.
DAMPING = 1e-7


@dataclass(frozen=True)
class Frame:
    """Coordinates of order one for the unknowns: `centre` (3,) and `radius` (length) of a model."""

    centre: Array
    radius: float

    @classmethod
    def of(cls, surfaces: Sequence[Surface], motions: Array) -> Frame:
        """The frame about all the samples of placed surfaces."""
        counts = np.array([len(s.points) for s in surfaces])
        placed = zip(surfaces, motions, strict=True)
        middles = np.stack([se3.apply(motion, s.moments[0]) for s, motion in placed])
        centre = counts @ middles / counts.sum()
        apart = counts @ ((middles - centre) ** 2).sum(axis=1)
        total = apart + sum(s.moments[1] for s in surfaces)
        return cls(centre, float(np.sqrt(total / counts.sum())) or 1.0)

    def motion(self, unknowns: Array) -> Array:
        """The motions (..., 4, 4) of unknowns (..., 6)."""
        steps = se3.exp(unknowns * np.array([1.0, 1, 1, *3 * [self.radius]]))
        return np.stack([se3.about(self.centre, step) for step in steps])

    @property
    def twists(self) -> Array:
        """(6, 6): twists about the model frame's origin, from the unknowns."""
        change = np.eye(6)
        change[3:, :3] = se3.skew(self.centre)
        change[3:, 3:] *= self.radius
        return change


@dataclass(frozen=True, eq=False)
class Rows:
    """The residuals of contacts under some poses.

    Parameters
    ----------
    contacts : Contacts
    residuals : (M,) array
        In units of `unit`.
    jacobian : (M, 6) array
        For the pose of a contact's source, and its negative for that of its target.
    points : (M, 3) array
        Where they are, in units of the frame's radius.
    aside : (M,) array
        How far along the patches, in units of their reach, squared.
    unit : (M,) array
        What residuals are in units of (length).
    """

    contacts: Contacts
    residuals: Array
    jacobian: Array
    points: Array
    aside: Array
    unit: Array

    @property
    def weights(self) -> Array:
        """(M,): those of the contacts, for residuals in these units."""
        return self.contacts.weights * self.unit**2

    @property
    def lengths(self) -> Array:
        """(M,): the residuals as lengths."""
        return self.residuals * self.unit

    def whitened(self, deviations: Array) -> Rows:
        """The same in units of what each residual is expected to be (M,), a length."""
        change = self.unit / deviations
        return replace(
            self,
            residuals=self.residuals * change,
            jacobian=self.jacobian * change[:, None],
            unit=deviations,
        )

    def in_parts(self, function: Callable[[slice, Indices], Answer]) -> list[Answer]:
        """What a function says of some of the ways at a time, with where their rows begin and end.

        In threads; in the order of the ways.
        """
        ends = self.contacts.ends
        parts = slices(len(self.contacts.ways), 1)
        return in_threads(lambda part: function(part, ends[part.start : part.stop + 1]), parts)


def rows(
    surfaces: Sequence[Surface], motions: Array, contacts: Contacts, frame: Frame, flat: bool
) -> Rows:
    """Point-to-surface residuals of all contacts, in units of the frame's radius."""
    size = len(contacts.samples)
    made = Rows(
        contacts, np.empty(size), np.empty((size, 6)), np.empty((size, 3)),
        np.empty(size), np.full(size, frame.radius),
    )  # fmt: skip
    patches = [surface.patches for surface in surfaces]  # built once, before the threads ask

    def fill(part: slice, ends: Indices) -> None:
        tile, mine = contacts.tile(part), slice(ends[0], ends[-1])
        residual_kernel.rows(
            patches, motions, tile.ways, tile.ends, tile.samples, tile.patches,
            frame.centre, frame.radius, flat, made.residuals[mine], made.jacobian[mine],
            made.points[mine], made.aside[mine],
        )  # fmt: skip

    made.in_parts(fill)
    return made


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
    def of(cls, found: Rows, free: Sequence[int], width: float) -> System:
        """Sum over all rows, each with its weight and the kernel's."""
        weights = found.weights
        sums = found.in_parts(
            lambda _, ends: kernel.normal_equations(
                found.jacobian, found.residuals, weights, ends, width
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
