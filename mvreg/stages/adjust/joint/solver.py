"""Gauss-Newton iterations of the joint refinement: coarse, then fine."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.kernels import residuals as kernel
from mvreg.stages.adjust.joint.correspondences import Contacts, Gate, contacts, touching
from mvreg.stages.adjust.joint.covariance import covariances
from mvreg.stages.adjust.joint.normal_equations import CUT, Frame, Rows, System, rows, spread
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.surface.partners import well_spread
from mvreg.types import Array, Link
from mvreg.types.view_graph import reachable

#: The phases, from far off to the end: contacts of every n-th sample, on planes or on curved
#: patches, no farther apart than (resolutions; None for the stage's own reach), until no point
#: would move farther in another round than (resolutions). A hundredth is a third of the scatter
#: that noise leaves on the Stanford scans.
PHASES = ((8, True, None, 0.2), (4, False, 2.0, 0.05), (1, False, 2.0, 0.01))
#: From one round to the next moves shrink by this at least, once the patches are asked: on Bunny,
#: Dragon, Buddha and a column of 30 and 150 scans by 7 to 45 (medians 15). A phase ends when the
#: next round would move no point farther than the phase allows: that round is not needed.
SHRINKING = 8.0
#: A phase also ends when moves have not shrunk to this share in two rounds: contacts that come and
#: go, as where things moved between scans, never come to rest.
STALLED = 0.5
#: Steps of two rounds have one direction if the cosine between them is this, at least, and are slow
#: to shrink if the second is as large as this share of the first. Of 1,000 scans of a column in a
#: row the far end then comes to rest within 0.01 resolutions instead of 0.05, in a round less.
ALIKE, SLOW = 0.8, 0.2
#: Where a sample lies on so many other scans in the mean, the last phase asks every second one. On
#: columns of 40 and 80 scans, and on Bunny, Dragon and Buddha if made to, that moves poses by 0.002
#: to 0.008 resolutions, adds a tenth to their standard deviations, and halves the phase's time.
CROWDED = 4.0
#: Steps of Gauss-Newton for one set of contacts, at most; fewer if points move by less than this
#: share of what ends the phase.
STEPS, SETTLED = 4, 0.3
#: Kernels are no narrower than this (resolutions): exact data have residuals of rounding only.
NARROWEST = 1e-6
#: Edge of the cells whose residuals are taken to be independent (radii of a patch).
CELL = 4.0


@dataclass(frozen=True, eq=False)
class Settled:
    """The converged poses that were free, their covariances, and the links that they rest on.

    `poses` and `covariances` by name, as in `Result`; `links` are ordered pairs.
    """

    poses: Mapping[str, Array]
    covariances: Mapping[str, Array]
    links: tuple[Link, ...]


@dataclass(frozen=True, eq=False)
class Solver:
    """The least-squares problem: named surfaces, the `fixed` ones, and the stage's parameters."""

    surfaces: Sequence[Surface]
    names: tuple[str, ...]
    fixed: frozenset[int]
    resolution: float
    reach: float
    kernel: float
    max_rounds: int

    def settle(self, poses: Sequence[Array]) -> Settled | None:
        """Optimise all poses connected to a fixed one by contacts; None if there are none."""
        motions, found, free, least = np.stack(poses), None, list[int](), 1
        meeting = touching(self.surfaces, motions, self.reach * self.resolution)
        chosen = frozenset(
            well_spread(meeting, [s.points for s in self.surfaces], list(motions), self.resolution)
        )
        left_out = frozenset(meeting) - chosen
        for stride, flat, near, still in PHASES:
            gate = Gate((near or self.reach) * self.resolution, max(stride, least), flat)
            moves, steps = list[float](), list[Array]()
            for _ in range(self.max_rounds):
                before = motions
                motions, found, free = self.round(motions, gate, still, left_out)
                steps.append(steps_between(before, motions))
                moves.append(self.farthest(before, motions))
                if moves[-1] <= SHRINKING * still or stalled(moves):
                    break
                motions = extrapolated(steps, motions, free)
            least = 2 if found is not None and self.crowded(found, gate) else 1
        return self.summary(motions, found, free) if found is not None and free else None

    def crowded(self, found: Contacts, gate: Gate) -> bool:
        """Whether every second sample is enough."""
        samples = sum(len(surface.points) for surface in self.surfaces)
        return len(found.samples) * gate.stride >= CROWDED * samples

    def round(
        self, motions: Array, gate: Gate, still: float, left_out: Collection[tuple[int, int]] = ()
    ) -> tuple[Array, Contacts, list[int]]:
        """One round of correspondences and Gauss-Newton: motions, contacts, and the free poses.

        Pairs that are `left_out` are not asked for contacts.
        """
        found, free = self.held(motions, gate, left_out)
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

    def held(
        self, motions: Array, gate: Gate, left_out: Collection[tuple[int, int]]
    ) -> tuple[Contacts, list[int]]:
        """Contacts among the scans connected to a fixed one, and the free poses among these."""
        near = touching(self.surfaces, motions, gate.reach)
        pairs = [pair for pair in near if pair not in left_out]
        found = contacts(self.surfaces, motions, pairs, gate)
        ways = [*map(tuple, found.ways.tolist())]
        joined = set().union(*(reachable(ways, k) for k in self.fixed))
        free = sorted(joined - self.fixed)
        return found.some(np.isin(found.ways[:, 0], list(joined))), free

    def width(self, residuals: Rows, frame: Frame) -> float:
        """The width of the robust kernel, in units of the frame's radius."""
        scatter = spread(residuals.residuals)
        return max(self.kernel * scatter, NARROWEST * self.resolution / frame.radius)

    def farthest(self, before: Array, after: Array) -> float:
        """How far any sample has moved, in resolutions."""
        moves = [
            kernel.farthest(s.points, old, new)
            for s, old, new in zip(self.surfaces, before, after, strict=True)
        ]
        return max(moves) / self.resolution

    def summary(self, motions: Array, found: Contacts, free: Sequence[int]) -> Settled:
        """Poses, covariances and links at convergence."""
        frame = Frame.of(self.surfaces, motions)
        residuals = rows(self.surfaces, motions, found, frame, flat=False)
        width = self.width(residuals, frame)
        system = System.of(residuals, free, width)
        reach = np.median(np.concatenate([surface.reach for surface in self.surfaces]))
        cell = CELL * float(reach) / frame.radius
        known = covariances(residuals, system, frame, width, cell)
        return Settled(
            {self.names[k]: motions[k] for k in free},
            {self.names[k]: np.zeros((6, 6)) for k in sorted(self.fixed)}
            | {self.names[k]: block for k, block in zip(free, known, strict=True)},
            tuple(self.links(residuals, CUT * width, frame)),
        )

    def links(self, residuals: Rows, cut: float, frame: Frame) -> list[Link]:
        """The pairs of scans with the samples that lie on each other."""
        ways = residuals.contacts.ways
        inside = np.abs(residuals.residuals) < cut
        each = np.repeat(np.arange(len(ways)), residuals.contacts.counts)[inside]
        counts = np.bincount(each, minlength=len(ways))
        squares = np.bincount(each, residuals.residuals[inside] ** 2, len(ways))
        scatter = frame.radius * np.sqrt(squares / np.maximum(counts, 1))
        return [
            Link(self.names[i], self.names[j], int(count), float(rms))
            for (i, j), count, rms in zip(ways.tolist(), counts, scatter, strict=True)
            if count
        ]


def steps_between(before: Array, after: Array) -> Array:
    """(N, 6): the twists about the origin that lead from poses (N, 4, 4) to others."""
    return np.stack([
        se3.log(new @ se3.invert(old)) for old, new in zip(before, after, strict=True)
    ])  # fmt: skip


def extrapolated(steps: Sequence[Array], motions: Array, free: Sequence[int]) -> Array:
    """Poses where rounds that go on as the last two did would end (Aitken's delta-squared process).

    Ends of long chains of scans follow their contacts by half of the way that is left, round after
    round. Where the last two steps (N, 6) have not one direction, or shrink fast, the poses stay.
    """
    if len(steps) < 2:
        return motions
    last, now = steps[-2].ravel(), steps[-1].ravel()
    squared = float(last @ last)
    ratio = float(now @ last) / squared if squared else 0.0
    alike = ratio * np.sqrt(squared) / (float(np.linalg.norm(now)) or 1.0)
    if alike < ALIKE or not SLOW < ratio < 1 - SLOW:
        return motions
    found = motions.copy()
    for k in free:
        found[k] = se3.project(se3.exp(steps[-1][k] * ratio / (1 - ratio)) @ found[k])
    return found


def stalled(moves: Sequence[float]) -> bool:
    """Whether the last of the moves is hardly smaller than two rounds before."""
    return len(moves) > 2 and moves[-1] > STALLED * moves[-3]
