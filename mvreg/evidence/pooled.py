"""How probable it is that scans are where a pose puts them: all that range scans can tell of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from mvreg.evidence.calibration import features, probability
from mvreg.evidence.pooling import Meeting as Meeting
from mvreg.evidence.pooling import firmness, free_space, most_covered
from mvreg.parallel import in_parts

#: Less is held too loosely. Pairs of a sphere, a cylinder and a bottle have 0.004 at most, with
#: noise of two spacings of the raw points. Right pairs of all sets that the search finds have 0.007
#: and more, but for one of the Buddha's.
LEAST_STABILITY = 0.005
#: What fits no better than this is no question of sliding: it does not fit.
LEAST_PLAUSIBILITY = 0.3
#: The reason where nothing speaks against a pose.
AGREED = "surfaces, normals and free space agree"
#: Fewer points that meet say nothing.
LEAST_POINTS = 50


@dataclass(frozen=True)
class Evidence:
    """What meetings show, pooled. Everything is free of units.

    Parameters
    ----------
    overlap : float
        Share of the points of a view that lie on the others' surface; of the view best covered.
    residual : float
        Root mean square point-to-plane distance there, in units of the scans' own noise floor.
    noise : float
        That noise floor, in resolutions: noise, and what the surface curves between points.
    agreement : float
        Share of those near the surface whose normals agree with it.
    violation : float or None
        Share of the points that a sensor can tell about which float in what it saw to be free; None
        where nothing is known of the sensors, nor can be told from the points.
    sensor : str
        "known", "estimated" or "none": what the violation rests on.
    stability : float
        How firmly the overlap holds, whatever way it is pushed; see `mvreg.stages.judge.stability`.
    pull : float
        How far the overlap asks the source to move to fit best (resolutions, about the root mean
        square of the points' motion); about 0 after a refinement.
    points : int
        How many points meet; after a rough look, how many would about.
    """

    overlap: float
    residual: float
    noise: float
    agreement: float
    violation: float | None
    sensor: str
    stability: float
    pull: float
    points: int

    @property
    def probability(self) -> float:
        """The probability that the pose is right, between 0 and 1; 0 where it is ambiguous."""
        return 0.0 if self.ambiguous else self.plausibility

    @property
    def plausibility(self) -> float:
        """The same, whether or not the overlap can slide along itself."""
        if self.points < LEAST_POINTS:
            return 0.0
        measured = features(
            self.overlap, self.residual, self.noise, self.agreement, self.violation, self.pull
        )
        return probability(measured, self.sensor)

    @property
    def ambiguous(self) -> bool:
        """Whether the overlap fits and can slide along itself, as on a sphere or a cylinder."""
        return self.stability < LEAST_STABILITY and self.plausibility > LEAST_PLAUSIBILITY

    @property
    def reason(self) -> str:
        """What speaks against the pose most, or that nothing does."""
        if self.points < LEAST_POINTS:
            return "the scans hardly meet"
        if self.ambiguous:
            return "ambiguous: the overlap can slide along itself"
        if self.violation is not None and self.violation > 0.1:
            return "a surface stands in what the other sensor saw to be free"
        if self.residual > 6:
            return "the surfaces do not lie on each other"
        if self.agreement < 0.8:
            return "normals disagree"
        if self.overlap < 0.2:
            return "too little overlap"
        return AGREED

    def as_dict(self) -> dict[str, float]:
        """What was measured, by name; what is not known is left out."""
        return {
            name: float(value)
            for name, value in asdict(self).items()
            if isinstance(value, int | float)
        }


def weigh(meetings: Sequence[Meeting]) -> Evidence:
    """Pool what all meetings show: evidence for or against all of them being right together.

    Parameters
    ----------
    meetings : sequence of Meeting
        One for a pair of scans; one scan against every part of a model; every scan of a partial
        model against every scan of another.

    Returns
    -------
    Evidence
        Of no points and an overlap of zero where nothing meets.
    """
    sides = in_parts(lambda meeting: meeting.sides, meetings)
    both = [side for pair in sides for side in pair]
    points = sum(side.count for side in both)
    near = sum(side.near for side in both)
    squared = sum(side.squared / (side.floor**2 or 1.0) for side in both)
    noise = sum(side.floor**2 * side.count for side in both)
    violation, sensor = free_space(both)
    stability, pull = firmness(meetings, sides)
    return Evidence(
        overlap=most_covered(meetings, sides),
        residual=float(np.sqrt(squared / points)) if points else 0.0,
        noise=float(np.sqrt(noise / points)) if points else 0.0,
        agreement=points / near if near else 0.0,
        violation=violation,
        sensor=sensor,
        stability=stability,
        pull=pull,
        points=points * max((meeting.step for meeting in meetings), default=1),
    )
