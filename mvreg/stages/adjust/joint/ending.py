"""What is told of a joint refinement at convergence: poses, how sure they are, and links."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.stages.adjust.joint.clusters import Clusters
from mvreg.stages.adjust.joint.covariance import (
    Blocks,
    cell_variance,
    classes,
    covariance_blocks,
    flatness,
    pose_scatter,
)
from mvreg.stages.adjust.joint.extended import Extended, Shape
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import System
from mvreg.stages.adjust.joint.patterns import patterns
from mvreg.stages.adjust.joint.rows import Residuals, Rows
from mvreg.stages.adjust.joint.scales import Oversize, oversize
from mvreg.stages.adjust.joint.stiffness import stiffness
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.stages.adjust.joint.weighting import RELIEF, Pooled
from mvreg.types import Array, Indices, Link, Pattern, PoseScatter, ScanScale
from mvreg.types.lazy import lazy

#: Edge of the cells whose residuals are taken together (radii of a patch). Patches reach over each
#: other, and what they do not follow reaches further; twice as large ones tell the same within a
#: tenth, on the shapes of `experiments.accuracy.bound`.
CELL = 7.0


@dataclass(frozen=True, eq=False)
class Settled:
    """The converged poses that were free, their covariances, and the links that they rest on.

    `poses` and `covariances` by name, as in `Result`; `links` are ordered pairs; `scatter` is that
    of all the poses at once; `patterns` are systematic errors of scans, `scales` those of all of
    them where they are estimated, and `oversize` what is left of them.
    """

    poses: Mapping[str, Array]
    covariances: Mapping[str, Array]
    links: tuple[Link, ...]
    scatter: PoseScatter
    patterns: tuple[Pattern, ...] = ()
    scales: tuple[ScanScale, ...] = ()
    oversize: Oversize | None = field(default=None, metadata={"stored": False})


@dataclass(frozen=True, eq=False)
class Ending:
    """Where a refinement has come to rest.

    Parameters
    ----------
    surfaces : sequence of Surface
    names : tuple of str
    motions : (N, 4, 4) array
    free, held : sequences of int
        The scans whose poses were free, and those whose poses were not.
    frame : Frame
    residuals : Rows or Residuals
        In units of what each is expected to be.
    width : float
        Of the kernel, in these units.
    known : Pooled
    resolution : float
    given : (N,) array or None
        Logarithms of what scans have been made smaller by, where scales are estimated.
    """

    surfaces: Sequence[Surface]
    names: tuple[str, ...]
    motions: Array
    free: Sequence[int]
    held: Sequence[int]
    frame: Frame
    residuals: Rows | Residuals
    width: float
    known: Pooled
    resolution: float
    given: Array | None = None

    def settled(self) -> Settled:
        """Poses, covariances and links."""
        scatter = self.scatter()
        blocks = covariance_blocks(scatter)
        place = {k: at for at, k in enumerate(self.free)} | dict.fromkeys(self.held, -1)
        return Settled(
            {self.names[k]: self.motions[k] for k in self.free},
            {self.names[k]: blocks[place[k], place[k]] for k in (*self.held, *self.free)},
            tuple(self.links(blocks, place)),
            scatter,
            self.patterns(),
            oversize=self.oversize,
        )

    def patterns(self) -> tuple[Pattern, ...]:
        """What is off in single scans, if they are few."""
        return patterns(
            self.extended, self.held, self.width, self.variance, self.variance_of, self.graded,
            self.names, self.resolution,
        )  # fmt: skip

    @lazy
    def oversize(self) -> Oversize | None:
        """How much too large scans are; None where their scales are taken as they are."""
        if self.given is None:
            return None
        lost = [
            Clusters.of(self.residuals, self.system, groups, self.width).lost
            for groups in self.graded
        ]
        found = oversize(
            self.extended, self.free, self.held, self.width, self.variance,
            list(zip(self.graded, lost, strict=True)), self.given,
        )  # fmt: skip
        flatter = flatness(self.residuals, self.width)
        return replace(found, covariance=flatter**2 * found.covariance)

    @lazy
    def extended(self) -> Extended:
        """The residuals with a scale and a bend for each scan."""
        shapes = [Shape(surface) for surface in self.surfaces]
        return Extended(self.residuals, shapes, self.motions, self.frame)

    def scatter(self) -> PoseScatter:
        """How the free poses err together."""
        stiff = stiffness(self.residuals, self.system, self.surfaces, self.motions, self.width)
        found = pose_scatter(
            self.residuals, self.system, stiff, self.frame, self.width,
            self.variance, self.graded,
            ([self.names[k] for k in self.free], [self.names[k] for k in self.held]),
        )  # fmt: skip
        return found if self.oversize is None else self.oversize.loosened(found)

    @lazy
    def system(self) -> System:
        """The normal equations of the free poses."""
        return System.of(self.residuals, list(self.free), self.width)

    @lazy
    def cell(self) -> float:
        """Edge of the cells, in the frame's radius."""
        reach = np.median(np.concatenate([surface.reach for surface in self.surfaces]))
        return CELL * float(reach) / self.frame.radius

    @lazy
    def variance(self) -> float:
        """Of the residuals, in units of what each is expected to be."""
        return self.variance_of(self.residuals)

    def variance_of(self, residuals: Rows | Residuals) -> float:
        """The same, of others of the same contacts."""
        return cell_variance(residuals, self.system, self.width, self.cell)

    @lazy
    def graded(self) -> list[Callable[[Rows], Indices]]:
        """Classes of rows by how well the points of the cell are known, and of the patch."""
        grades = classes(self.known.noise + RELIEF * self.known.misfit)
        return [
            lambda some: grades[self.known.places(some.contacts)[0]],
            lambda some: grades[self.known.places(some.contacts)[1]],
        ]

    def links(self, blocks: Blocks, place: Mapping[int, int]) -> list[Link]:
        """The pairs of scans with the samples that lie on each other, and how sure they are."""
        ways = self.residuals.contacts.ways
        parts = self.residuals.contacts.parts()
        counts, squares = np.hstack([self.inside(part) for part in parts])
        scatter = np.sqrt(squares / np.maximum(counts, 1))
        return [
            Link(
                self.names[i], self.names[j], count, rms,
                blocks.relative(place[i], place[j], self.motions[j]),
            )
            for (i, j), count, rms in zip(
                ways.tolist(), counts.astype(int).tolist(), scatter.tolist(), strict=True
            )
            if count
        ]  # fmt: skip

    def inside(self, part: slice) -> Array:
        """(2, W): how many residuals of some ways are within the kernel; their squares' sum."""
        mine = self.residuals.contacts.rows(part)
        residuals = self.residuals.residuals[mine]
        inside = np.abs(residuals) < self.width
        counts = np.diff(self.residuals.contacts.ends[part.start : part.stop + 1])
        each = np.repeat(np.arange(len(counts)), counts)[inside]
        squares = (residuals[inside] * self.residuals.unit[mine][inside]) ** 2
        return np.stack([
            np.bincount(each, minlength=len(counts)), np.bincount(each, squares, len(counts)),
        ])  # fmt: skip
