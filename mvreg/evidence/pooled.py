"""The probability that relative poses are right, from the pooled evidence of range scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from mvreg.evidence.calibration import (
    LEAST_COMPARED,
    LEAST_COUNTED,
    LEAST_VIOLATION,
    features,
    log_odds,
    probability,
)
from mvreg.evidence.pooling import ViewPair as ViewPair
from mvreg.evidence.pooling import (
    free_space_violation,
    largest_surface_overlap,
    localizability_and_step,
)
from mvreg.parallel import in_parts
from mvreg.types import Array

#: Below it the overlap is degenerate. Pairs of a sphere, a cylinder and a bottle have 0.004 at
#: most, with noise of two spacings of the raw points. Right pairs of all sets that the search
#: finds have 0.007 and more, but for one of the Buddha's.
LEAST_LOCALIZABILITY = 0.005
#: Below this plausibility a pose is not called degenerate: it does not fit at all.
LEAST_PLAUSIBILITY = 0.3
#: The reason if there is no objection to a pose.
CONSISTENT = "surfaces, normals and free space agree"
#: Fewer points in contact are no evidence.
LEAST_POINTS = 50


@dataclass(frozen=True)
class Evidence:
    """The evidence of view pairs, pooled. Everything is free of units.

    Parameters
    ----------
    surface_overlap : float
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
    localizability : float
        Smallest eigenvalue of the normalised information matrix of the points in contact: 0 where
        the overlap can slide along itself (see the glossary).
    residual_step : float
        Length of the Gauss-Newton step that is left (resolutions, about the root mean
        square of the points' motion); about 0 after a refinement.
    points : int
        Points in contact; on a subsample, the number extrapolated to all.
    """

    surface_overlap: float
    residual: float
    noise: float
    agreement: float
    violation: float | None
    sensor: str
    localizability: float
    residual_step: float
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
        return probability(self._features(), self.sensor)

    def log_odds_over(self, other: Evidence) -> float:
        """Logarithm of the odds of this pose over those of another pose of the same scans.

        Violations count that are too few to mean anything by themselves: in the right pose hardly
        any of the points of a facade float, and in one that is a window off a twentieth does.
        """
        points = max(min(self.points, other.points), 1)
        least = min(max(LEAST_COMPARED, LEAST_COUNTED / points), LEAST_VIOLATION)
        own, others = (log_odds(one._features(least), one.sensor) for one in (self, other))
        return own - others

    def _features(self, least_violation: float = LEAST_VIOLATION) -> Array:
        return features(
            self.surface_overlap,
            self.residual,
            self.noise,
            self.agreement,
            self.violation,
            self.residual_step,
            least_violation,
        )

    @property
    def ambiguous(self) -> bool:
        """Whether the overlap fits and can slide along itself, as on a sphere or a cylinder."""
        return self.localizability < LEAST_LOCALIZABILITY and self.plausibility > LEAST_PLAUSIBILITY

    @property
    def reason(self) -> str:
        """The strongest objection to the pose, or that there is none."""
        if self.points < LEAST_POINTS:
            return "the scans barely overlap"
        if self.ambiguous:
            return "ambiguous: the overlap can slide along itself"
        if self.violation is not None and self.violation > 0.05:
            return "free-space violation: a surface lies where the other sensor saw free space"
        if self.residual > 6:
            return "the surfaces do not coincide"
        if self.agreement < 0.8:
            return "normals disagree"
        if self.surface_overlap < 0.2:
            return "too little overlap"
        return CONSISTENT

    def as_dict(self) -> dict[str, float]:
        """What was measured, by name; what is not known is left out."""
        return {
            name: float(value)
            for name, value in asdict(self).items()
            if isinstance(value, int | float)
        }


def pool_evidence(view_pairs: Sequence[ViewPair]) -> Evidence:
    """Pool the evidence of all view pairs: for or against all of them being right together.

    Parameters
    ----------
    view pairs : sequence of ViewPair
        One for a pair of scans; one scan against every part of a model; every scan of a partial
        model against every scan of another.

    Returns
    -------
    Evidence
        Of no points and no surface overlap where there is no contact.
    """
    sides = in_parts(lambda view_pair: view_pair.sides, view_pairs)
    both = [side for pair in sides for side in pair]
    points = sum(side.count for side in both)
    near = sum(side.near for side in both)
    squared = sum(side.squared / (side.noise_floor**2 or 1.0) for side in both)
    noise = sum(side.noise_floor**2 * side.count for side in both)
    violation, sensor = free_space_violation(both)
    localizability, residual_step = localizability_and_step(view_pairs, sides)
    return Evidence(
        surface_overlap=largest_surface_overlap(view_pairs, sides),
        residual=float(np.sqrt(squared / points)) if points else 0.0,
        noise=float(np.sqrt(noise / points)) if points else 0.0,
        agreement=points / near if near else 0.0,
        violation=violation,
        sensor=sensor,
        localizability=localizability,
        residual_step=residual_step,
        points=points * max((view_pair.step for view_pair in view_pairs), default=1),
    )
