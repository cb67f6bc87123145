"""Judge a registration by its evidence, by alternative poses, and by loop closure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError, check_positive
from mvreg.evidence.pairing import on_few_points, view_pairs
from mvreg.evidence.pooled import CONSISTENT, Evidence, ViewPair, pool_evidence
from mvreg.geometry import se3
from mvreg.surface.displacement import rms_apart
from mvreg.types import Array, Registration, Verdict, View, ViewGraph

#: An alternative is evaluated on a subsample first. If it is less probable than this share of what
#: would make it one, that is all: on the Stanford scans the two evaluations differ by 0.001 at
#: most.
NEGLIGIBLE = 0.1
#: An alternative is no rival of a pose with so many times its odds: of an object on a plate, which
#: holds two thirds of the points, turned poses have up to 0.5, the right ones 0.999. The right
#: pose of two scans of a facade has 95 times the odds of the one that is a window off.
CLEARLY = 50.0
#: A pose under which more of the points float is not compared with others by what floats: it may be
#: wrong as they are, and fit a little better. Of a facade the right poses have 0.005 and less.
HARDLY = 0.005


def odds(probability: float) -> float:
    """The odds of a probability; a thousand million at most."""
    return probability / max(1 - probability, 1e-9)


@dataclass(frozen=True)
class EvidenceJudge:
    """Reliable if the pose is probably right, no alternative is as good, and loops close.

    The probability is that of `mvreg.evidence.pooled.pool_evidence`, calibrated by
    ``experiments/calibration/calibrate.py``; of a model with parts it is that of the source meeting
    all of them. The verdict's score is the probability of being wrong.

    Parameters
    ----------
    min_probability : float
        Least probability of a reliable pose.
    min_probability_blind : float
        The same where no sensor is known, nor can be told from the points: nothing shows what is
        free then, and rooms fit themselves turned. Of fused fragments of kitchens wrong poses have
        up to 0.997, most right ones 0.998 and more (``experiments/accuracy/kinds.py``).
    max_alternative : float
        Largest probability, taken by itself, of a clearly different pose of the same pair, unless
        the odds of the pose are fifty times as large.
    alternative_angle : float
        Alternatives that differ by more than this (degrees) are clearly different, so are those
        `alternative_distance` apart. 10 is the paper's own separation of candidates.
    alternative_distance : float
        Of the source's points, root mean square, in spacings of the keypoints.
    loop_tolerance : float
        Where accepted registrations already lead from source to target, the pose may differ from
        theirs by this (RMS of the source's points, in resolutions), times the root of the number of
        registrations in the loop.
    min_overlap : float
        Of the view that is covered best, as in `TmseJudge`: `grow` lowers it level by level.
    """

    min_probability: float = 0.95
    min_probability_blind: float = 0.998
    max_alternative: float = 0.3
    alternative_angle: float = 10.0
    alternative_distance: float = 3.0
    loop_tolerance: float = 4.0
    min_overlap: float = 0.0

    def __post_init__(self) -> None:
        for name in ("min_probability", "min_probability_blind", "max_alternative"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(
                    f"judge.{name}: expected a probability between 0 and 1, got "
                    f"{getattr(self, name)}"
                )
        check_positive(
            "judge",
            alternative_angle=self.alternative_angle,
            alternative_distance=self.alternative_distance,
            loop_tolerance=self.loop_tolerance,
        )

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> Verdict:
        pose = registration.T_target_source
        evidence = pool_evidence(view_pairs(source, target, pose))
        alternative = self.best_alternative(registration, source, target, evidence)
        reason = self.objection(evidence, alternative)
        open_loop = reason is None and not self.closes_loops(registration, source, target, graph)
        if open_loop:
            reason = "the loop through accepted registrations does not close"
        own, other = odds(evidence.probability), odds(alternative)
        confidence = own / (1 + own + other)  # one of the poses at most is right
        return Verdict(
            reason is None, 1 - confidence, 1 - self.least(evidence), reason or evidence.reason,
            confidence, evidence.as_dict(), open_loop,
        )  # fmt: skip

    def together(self, pairs: Sequence[ViewPair]) -> Evidence:
        """Pool what view pairs show, as `mvreg.evidence.pooled.pool_evidence`."""
        return pool_evidence(pairs)

    def least(self, evidence: Evidence) -> float:
        """The least probability of a reliable pose, by what the evidence rests on."""
        return self.min_probability_blind if evidence.sensor == "none" else self.min_probability

    def objection(self, evidence: Evidence, alternative: float) -> str | None:
        """Why the pose cannot be relied on, by itself or for its best alternative."""
        if evidence.ambiguous:
            return evidence.reason
        if alternative > self.max_alternative and odds(evidence.probability) < (
            CLEARLY * odds(alternative)
        ):
            return "ambiguous: another pose is as probable"
        if evidence.surface_overlap < self.min_overlap:
            return f"overlap below {self.min_overlap:g}"
        if evidence.probability >= self.least(evidence):
            return None
        return (
            "probability below the threshold" if evidence.reason == CONSISTENT else evidence.reason
        )

    def closes_loops(
        self,
        registration: Registration,
        source: View,
        target: View,
        graph: ViewGraph,
    ) -> bool:
        """Whether the pose agrees with what accepted registrations say, where they do."""
        loop = graph.loop(source, target)
        if loop is None:
            return True
        allowed = self.loop_tolerance * source.scale.resolution * np.sqrt(loop.steps + 1)
        return bool(rms_apart(source.points, registration.T_target_source, loop.motion) <= allowed)

    def best_alternative(
        self, registration: Registration, source: View, target: View, evidence: Evidence
    ) -> float:
        """The probability of the best of the clearly different poses.

        Taken by itself, or less if the `evidence` for the pose is so much better.
        """
        return max(
            (
                self.likelihood(source, target, pose, evidence)
                for pose in self.distinct_alternatives(registration, source)
            ),
            default=0.0,
        )

    def likelihood(
        self, source: View, target: View, T_target_source: Array, evidence: Evidence
    ) -> float:
        """How plausible an alternative is: on few points only, if it is far from being one."""
        for pairs in on_few_points(source, target, T_target_source):
            likely = pool_evidence(pairs).plausibility
            if likely < NEGLIGIBLE * self.max_alternative:
                return likely
        rival = pool_evidence(view_pairs(source, target, T_target_source))
        hardly = evidence.violation is not None and evidence.violation <= HARDLY
        better = evidence.log_odds_over(rival) if hardly else 0.0
        if better <= 0:
            return rival.plausibility
        beside = odds(evidence.probability) * np.exp(-better)
        return float(min(rival.plausibility, beside / (1 + beside)))

    def distinct_alternatives(self, registration: Registration, source: View) -> list[Array]:
        """The alternatives that are clearly different from the pose."""
        pose = registration.T_target_source
        apart = self.alternative_distance * source.scale.spacing
        return [
            alternative
            for alternative in registration.alternatives
            if np.rad2deg(se3.rotation_angle(alternative, pose)) > self.alternative_angle
            or rms_apart(source.points, alternative, pose) > apart
        ]
