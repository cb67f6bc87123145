"""The search for the poses at which all surfaces lie on each other: coarse, then fine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.kernels import joint
from mvreg.stages.joint_contacts import Contacts, Gate, contacts, touching
from mvreg.stages.joint_covariance import covariances
from mvreg.stages.joint_surface import Surface
from mvreg.stages.joint_system import CUT, Frame, Rows, System, rows, spread
from mvreg.stages.view_graph import reachable
from mvreg.types import Array, Link

#: The phases, from far off to the end: contacts of every n-th sample, on planes or on curved
#: patches, no farther apart than (resolutions; None for the stage's own reach), until no point
#: would move farther in another round than (resolutions). A hundredth is a third of the scatter
#: that noise leaves on the Stanford scans.
PHASES = ((8, True, None, 0.2), (4, False, 2.0, 0.05), (1, False, 2.0, 0.01))
#: From one round to the next moves shrink by this at least, once the patches are asked: on Bunny,
#: Dragon, Buddha and a column of 30 and 150 scans by 7 to 45 (medians 15). A phase ends when the
#: next round would move no point farther than the phase allows: that round is not needed.
SHRINKING = 8.0
#: Steps of Gauss-Newton for one set of contacts, at most; fewer if points move by less than this
#: share of what ends the phase.
STEPS, SETTLED = 4, 0.3
#: Kernels are no narrower than this (resolutions): exact data have residuals of rounding only.
NARROWEST = 1e-6
#: Edge of the cells whose residuals are taken to be independent (radii of a patch).
CELL = 4.0


@dataclass(frozen=True, eq=False)
class Settled:
    """Where the poses came to rest: those that moved, what is known of them, and what they rest on.

    `poses` and `covariances` by name, as in `Result`; `links` are ordered pairs.
    """

    poses: Mapping[str, Array]
    covariances: Mapping[str, Array]
    links: tuple[Link, ...]


@dataclass(frozen=True, eq=False)
class Solver:
    """The problem: surfaces, their names, the one held `fixed`, and the stage's parameters."""

    surfaces: Sequence[Surface]
    names: tuple[str, ...]
    fixed: int
    resolution: float
    reach: float
    kernel: float
    max_rounds: int

    def settle(self, poses: Sequence[Array]) -> Settled | None:
        """Move all poses that a chain of contacts joins to the fixed one; None if there is none."""
        motions, found, free = np.stack(poses), list[Contacts](), list[int]()
        for stride, flat, near, still in PHASES:
            gate = Gate((near or self.reach) * self.resolution, stride, flat)
            for _ in range(self.max_rounds):
                before = motions
                motions, found, free = self.round(motions, gate, still)
                if self.farthest(before, motions) <= SHRINKING * still:
                    break
        return self.summary(motions, found, free) if free else None

    def round(
        self, motions: Array, gate: Gate, still: float
    ) -> tuple[Array, list[Contacts], list[int]]:
        """Find contacts and solve: the motions, the contacts, and what was free to move."""
        found, free = self.held(motions, gate)
        if not free:
            return motions, found, free
        frame = Frame.of(self.surfaces, motions)
        for _ in range(1 if gate.flat else STEPS):
            before, motions = motions, motions.copy()
            residuals = rows(self.surfaces, motions, found, frame, gate.flat)
            step = System.of(residuals, free, self.width(residuals, frame)).step()
            motions[free] = frame.motion(step) @ motions[free]
            if self.farthest(before, motions) <= SETTLED * still:
                break
        for k in free:
            motions[k] = se3.project(motions[k])
        return motions, found, free

    def held(self, motions: Array, gate: Gate) -> tuple[list[Contacts], list[int]]:
        """Contacts of all that hangs together with the fixed scan, and what may move of it."""
        pairs = touching(self.surfaces, motions, gate.reach)
        found = contacts(self.surfaces, motions, pairs, gate)
        joined = reachable(((one.i, one.j) for one in found), self.fixed)
        free = sorted(joined - {self.fixed})
        return [one for one in found if one.i in joined], free

    def width(self, residuals: Sequence[Rows], frame: Frame) -> float:
        """The kernel's width, in the frame's radius."""
        return max(self.kernel * spread(residuals), NARROWEST * self.resolution / frame.radius)

    def farthest(self, before: Array, after: Array) -> float:
        """How far any sample has moved, in resolutions."""
        moves = [
            joint.farthest(s.points, old, new)
            for s, old, new in zip(self.surfaces, before, after, strict=True)
        ]
        return max(moves) / self.resolution

    def summary(self, motions: Array, found: Sequence[Contacts], free: Sequence[int]) -> Settled:
        """What to report of the poses found, given the contacts that they rest on."""
        frame = Frame.of(self.surfaces, motions)
        residuals = rows(self.surfaces, motions, found, frame, flat=False)
        width = self.width(residuals, frame)
        system = System.of(residuals, free, width)
        reach = np.median(np.concatenate([surface.reach for surface in self.surfaces]))
        cell = CELL * float(reach) / frame.radius
        known = covariances(residuals, system, frame, width, cell)
        return Settled(
            {self.names[k]: motions[k] for k in free},
            {self.names[self.fixed]: np.zeros((6, 6))}
            | {self.names[k]: block for k, block in zip(free, known, strict=True)},
            tuple(self.links(residuals, CUT * width, frame)),
        )

    def links(self, residuals: Sequence[Rows], cut: float, frame: Frame) -> list[Link]:
        """The pairs of scans with the samples that lie on each other."""
        found = []
        for one in residuals:
            inside = np.abs(one.residuals) < cut
            if inside.any():
                rms = frame.radius * float(np.sqrt((one.residuals[inside] ** 2).mean()))
                found.append(Link(self.names[one.i], self.names[one.j], int(inside.sum()), rms))
        return found
