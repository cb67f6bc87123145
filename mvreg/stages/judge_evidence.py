"""Judge a registration by all that range scans can tell: their fit, loops, and rival poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.errors import InputError, check_positive
from mvreg.evidence import Evidence, Meeting, weigh
from mvreg.types import Array, Model, Registration, Verdict, View


def meetings(source: View, target: View, T_target_source: Array) -> list[Meeting]:
    """Of a scan with a view: with every part of it, if it is a model that has parts."""
    if not isinstance(target, Model) or not target.parts:
        return [Meeting(source, target, T_target_source)]
    return [
        Meeting(source, part.view, se3.invert(part.T_model_scan) @ T_target_source)
        for part in target.parts
    ]


def path(start: str, end: str, accepted: Sequence[Registration]) -> tuple[Array, int] | None:
    """The motion from one scan to another along accepted registrations, the fewest there are.

    Returns
    -------
    (T_end_start, steps) or None
        None where no path of names leads there.
    """
    links: dict[str, list[tuple[str, Array]]] = {}
    for one in accepted:
        links.setdefault(one.source, []).append((one.target, one.T_target_source))
        links.setdefault(one.target, []).append((one.source, se3.invert(one.T_target_source)))
    found: dict[str, tuple[Array, int]] = {start: (np.eye(4), 0)}
    waiting = [start]
    while waiting and end not in found:
        name = waiting.pop(0)
        motion, steps = found[name]
        for other, T_other_name in links.get(name, []):
            if other not in found:
                found[other] = T_other_name @ motion, steps + 1
                waiting.append(other)
    return found.get(end)


def distance(source: View, first: Array, second: Array) -> float:
    """How far apart two poses put the source's points (RMS, length)."""
    gaps = se3.apply(first, source.points) - se3.apply(second, source.points)
    return float(np.sqrt((gaps**2).sum(axis=1).mean())) if len(gaps) else 0.0


@dataclass(frozen=True)
class EvidenceJudge:
    """Reliable if the pose is probably right, no rival is as good, and loops close.

    The probability is that of `mvreg.evidence.weigh`, calibrated by ``experiments/evidence.py``;
    of a model with parts it is that of the source meeting all of them. The verdict's score is the
    probability of being wrong.

    Parameters
    ----------
    min_probability : float
        Least probability of a reliable pose.
    min_odds : float
        The odds of the pose must be this many times those of any clearly different rival.
    rival_angle : float
        Rivals that differ by more than this (degrees) are clearly different, so are those
        `rival_distance` apart. 10 is the paper's own separation of candidates.
    rival_distance : float
        Of the source's points, root mean square, in spacings of the keypoints.
    loop_tolerance : float
        Where accepted registrations already lead from source to target, the pose may differ from
        theirs by this (RMS of the source's points, in resolutions), times the root of the number of
        registrations in the loop.
    """

    min_probability: float = 0.9
    min_odds: float = 3.0
    rival_angle: float = 10.0
    rival_distance: float = 3.0
    loop_tolerance: float = 4.0

    def __post_init__(self) -> None:
        if not 0 < self.min_probability < 1:
            raise InputError(
                "judge.min_probability: expected a probability between 0 and 1, got "
                f"{self.min_probability}"
            )
        check_positive(
            "judge",
            min_odds=self.min_odds,
            rival_angle=self.rival_angle,
            rival_distance=self.rival_distance,
            loop_tolerance=self.loop_tolerance,
        )

    def __call__(
        self,
        registration: Registration,
        source: View,
        target: View,
        accepted: Sequence[Registration],
    ) -> Verdict:
        pose = registration.T_target_source
        evidence = weigh(meetings(source, target, pose))
        reason = self.objection(evidence, registration, source, target, accepted)
        confidence = evidence.probability
        return Verdict(
            reason is None, 1 - confidence, 1 - self.min_probability, reason or evidence.reason,
            confidence, evidence.as_dict(),
        )  # fmt: skip

    def objection(
        self,
        evidence: Evidence,
        registration: Registration,
        source: View,
        target: View,
        accepted: Sequence[Registration],
    ) -> str | None:
        """Why the pose cannot be relied on, None where it can."""
        if evidence.ambiguous or evidence.probability < self.min_probability:
            return evidence.reason
        pose = registration.T_target_source
        joined = path(source.name, target.name, accepted)
        if joined is not None:
            allowed = self.loop_tolerance * source.scale.resolution * np.sqrt(joined[1] + 1)
            if distance(source, pose, joined[0]) > allowed:
                return "the loop through accepted registrations does not close"
        if self.rivalled(evidence, registration, source, target):
            return "ambiguous: another pose is as probable"
        return None

    def rivalled(
        self, evidence: Evidence, registration: Registration, source: View, target: View
    ) -> bool:
        """Whether a clearly different pose of the same pair is about as probable."""
        for rival in self.different(registration, source):
            other = weigh(meetings(source, target, rival))
            if odds(other) * self.min_odds > odds(evidence):
                return True
        return False

    def different(self, registration: Registration, source: View) -> list[Array]:
        """The rivals that are clearly different from the pose."""
        pose = registration.T_target_source
        apart = self.rival_distance * source.scale.spacing
        return [
            rival
            for rival in registration.rivals
            if np.rad2deg(se3.rotation_angle(rival, pose)) > self.rival_angle
            or distance(source, rival, pose) > apart
        ]


def odds(evidence: Evidence) -> float:
    """Probability of being right over that of being wrong; finite."""
    wrong = max(1 - evidence.probability, 1e-9)
    return evidence.probability / wrong
