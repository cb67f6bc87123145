"""Gauss-Newton iterations of the joint refinement: coarse, then fine."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.geometry import se3
from mvreg.kernels import residuals as kernel
from mvreg.stages.adjust.joint.convergence import extrapolated, stalled, steps_between
from mvreg.stages.adjust.joint.correspondences import (
    FLAT_LEAST_COSINE,
    LEAST_COSINE,
    Contacts,
    Gate,
    contacts,
    touching,
)
from mvreg.stages.adjust.joint.ending import Ending, Settled
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import System, spread, summed
from mvreg.stages.adjust.joint.rows import Residuals, Rows, rows
from mvreg.stages.adjust.joint.surface import EXACT, Surface
from mvreg.stages.adjust.joint.systematic import NONE, Systematic, systematic
from mvreg.stages.adjust.joint.trust import Trust
from mvreg.stages.adjust.joint.weighting import Pooled, by_noise, plainly, predicted
from mvreg.surface.partners import well_spread
from mvreg.types import Array
from mvreg.types.lazy import lazy
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
#: Where a sample lies on so many other scans in the mean, the last phase asks every second one. On
#: columns of 40 and 80 scans, and on Bunny, Dragon and Buddha if made to, that moves poses by 0.002
#: to 0.008 resolutions, adds a tenth to their standard deviations, and halves the phase's time.
CROWDED = 4.0
#: Steps of Gauss-Newton for one set of contacts, at most; fewer if points move by less than this
#: share of what ends the phase.
STEPS, SETTLED = 4, 0.3
#: So many contacts, spread over all, tell what scans get wrong together, and so many how residuals
#: scatter (to a hundredth).
TOLD, SAMPLED = 50_000, 16_000
#: Systematic errors are estimated in so many rounds of a phase, and then stay: what changes with
#: every round never comes to rest.
ESTIMATED = 2


@dataclass(frozen=True, eq=False)
class Round:
    """Where a round ended: all motions (N, 4, 4), and which of them are `free`; its contacts.

    `trust` is what was made of the contacts, `wrong` what scans were taken to get wrong together.
    """

    motions: Array
    contacts: Contacts | None = None
    free: tuple[int, ...] = ()
    trust: Trust | None = None
    wrong: Systematic = NONE


@dataclass(frozen=True, eq=False)
class Solver:
    """The least-squares problem: named surfaces, the `fixed` ones, and the stage's parameters.

    `given`, where scales are estimated, is as in `Ending`.
    """

    surfaces: Sequence[Surface]
    names: tuple[str, ...]
    fixed: frozenset[int]
    resolution: float
    reach: float
    kernel: float
    max_rounds: int
    given: Array | None = None

    @lazy
    def known(self) -> Pooled:
        """What is known at the samples of all surfaces."""
        return Pooled.of(self.surfaces)

    def settle(self, poses: Sequence[Array]) -> Settled | None:
        """Optimise all poses connected to a fixed one by contacts; None if there are none."""
        now, least = Round(np.stack(poses)), 1
        meeting = touching(self.surfaces, now.motions, self.reach * self.resolution)
        chosen = frozenset(
            well_spread(
                meeting, [s.points for s in self.surfaces], list(now.motions), self.resolution
            )
        )
        left_out = frozenset(meeting) - chosen
        for stride, flat, near, still in PHASES:
            cosine = FLAT_LEAST_COSINE if flat else LEAST_COSINE
            reach = (near or self.reach) * self.resolution
            gate = Gate(reach, max(stride, least), flat, cosine)
            moves, steps = list[float](), list[Array]()
            for done in range(self.max_rounds):
                before, wrong = now.motions, now.wrong if done >= ESTIMATED else None
                now = self.round(before, gate, still, left_out, wrong)
                steps.append(steps_between(before, now.motions))
                moves.append(self.farthest(before, now.motions))
                if moves[-1] <= SHRINKING * still or stalled(moves):
                    break
                now = replace(now, motions=extrapolated(steps, now.motions, now.free))
            least = 2 if now.contacts is not None and self.crowded(now.contacts, gate) else 1
        return self.summary(now) if now.contacts is not None and now.free else None

    def crowded(self, found: Contacts, gate: Gate) -> bool:
        """Whether every second sample is enough."""
        samples = sum(len(surface.points) for surface in self.surfaces)
        return len(found.samples) * gate.stride >= CROWDED * samples

    def round(
        self,
        motions: Array,
        gate: Gate,
        still: float,
        left_out: Collection[tuple[int, int]] = (),
        wrong: Systematic | None = None,
    ) -> Round:
        """One round of correspondences and Gauss-Newton.

        Pairs that are `left_out` are not asked for contacts. What scans get `wrong` together is
        estimated if not given.
        """
        found, free = self.held(motions, gate, left_out)
        if not free:
            return Round(motions, found)
        frame, some = Frame.of(self.surfaces, motions), found.thinned(SAMPLED)
        trust, wrong = self.trusted(motions, found, frame, gate, wrong)
        for _ in range(1 if gate.flat else STEPS):
            apart = rows(self.surfaces, motions, some, frame, gate.flat)
            before, motions = motions, motions.copy()
            width = self.width(apart.expected(trust))
            system = self.system(before, found, trust, free, frame, gate.flat, width)
            motions[free] = frame.motion(system.step()) @ motions[free]
            if self.farthest(before, motions) <= SETTLED * still:
                break
        for k in free:
            motions[k] = se3.project(motions[k])
        return Round(motions, found, tuple(free), trust, wrong)

    def trusted(
        self, motions: Array, found: Contacts, frame: Frame, gate: Gate, wrong: Systematic | None
    ) -> tuple[Trust, Systematic]:
        """What contacts are worth, and what scans get wrong together."""
        known = self.known
        if gate.flat:
            return plainly(known, found, gate.stride), NONE
        if wrong is None:
            some = found.thinned(TOLD)
            apart = rows(self.surfaces, motions, some, frame, gate.flat)
            noise = predicted(known, some, apart.aside, NONE)
            samples, patches = known.places(some)
            wrong = systematic(known.cosines[samples], known.cosines[patches], apart.lengths, noise)
        return by_noise(known, found, gate.stride, wrong), wrong

    def system(
        self, motions: Array, found: Contacts, trust: Trust, free: Sequence[int], frame: Frame,
        flat: bool, width: float,
    ) -> System:  # fmt: skip
        """The normal equations, summed up tile by tile: no row of them is kept."""
        patches = [surface.patches for surface in self.surfaces]
        sums = found.in_tiles(
            lambda tile: summed(patches, motions, tile, trust, frame, flat, width)
        )
        return System.assembled(found.ways, sums, free)

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

    def width(self, residuals: Rows | Residuals) -> float:
        """The width of the robust kernel, in units of the residuals."""
        least = EXACT * self.resolution / float(np.median(residuals.unit))
        return max(self.kernel * spread(residuals.residuals), least)

    def farthest(self, before: Array, after: Array) -> float:
        """How far any sample has moved, in resolutions."""
        moves = [
            kernel.farthest(s.points, old, new)
            for s, old, new in zip(self.surfaces, before, after, strict=True)
        ]
        return max(moves) / self.resolution

    def summary(self, end: Round) -> Settled:
        """Poses, covariances and links at convergence."""
        assert end.contacts is not None and end.trust is not None
        frame = Frame.of(self.surfaces, end.motions)
        residuals = Residuals.of(self.surfaces, end.motions, end.contacts, end.trust, frame)
        return Ending(
            self.surfaces, self.names, end.motions, end.free, sorted(self.fixed), frame,
            residuals, self.width(residuals), self.known, self.resolution,
            self.given,
        ).settled()  # fmt: skip
