"""The records that stages exchange: matches, candidates, registrations, verdicts.

Public as part of `mvreg.types`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mvreg.errors import RecordError
from mvreg.geometry.arrays import Array, Indices
from mvreg.types import checks


@dataclass(frozen=True, eq=False)
class Matches:
    """Index pairs `indices` (M, 2) of source and target keypoints, best first.

    `distances` (M,) are the descriptor distances.
    """

    indices: Indices
    distances: Array

    def __post_init__(self) -> None:
        indices = checks.integers("Matches.indices", self.indices, "M", 2)
        distances = checks.floats("Matches.distances", self.distances, len(indices))
        checks.keep(self, indices=indices, distances=distances)

    def __len__(self) -> int:
        return len(self.indices)

    @classmethod
    def none(cls) -> Matches:
        """No match."""
        return cls(np.empty((0, 2), dtype=np.intp), np.empty(0))


@dataclass(frozen=True, eq=False)
class Candidates:
    """Hypotheses for one pair, best first; empty where there is none.

    `poses` (C, 4, 4) are ``T_target_source``; `scores` (C,), lower is better; `matches` holds for
    each the propagated matches (M, 2) that support it.
    """

    poses: Array
    scores: Array
    matches: tuple[Indices, ...]

    def __post_init__(self) -> None:
        poses = checks.poses("Candidates.poses", self.poses)
        scores = checks.floats("Candidates.scores", self.scores, len(poses))
        checks.instance("Candidates.matches", self.matches, tuple)
        if len(self.matches) != len(poses):
            raise RecordError(
                f"Candidates.matches: expected {len(poses)} arrays, one per pose, "
                f"got {len(self.matches)}"
            )
        checks.keep(self, poses=poses, scores=scores)

    def __len__(self) -> int:
        return len(self.poses)

    @classmethod
    def none(cls) -> Candidates:
        """No candidate."""
        return cls(np.empty((0, 4, 4)), np.empty(0), ())


@dataclass(frozen=True, eq=False)
class Registration:
    """One refined pose and the trimmed pairs that it rests on.

    `overlap` is the fraction of source points kept (xi), `trimmed_mse` the mean of their squared
    distances (length^2), `objective` what the refinement minimised; `pairs` (P, 2) are indices of
    source and target points under `T_target_source`, `distances` (P,) their lengths, and
    `trim_distance` the largest length kept. `alternatives` (R, 4, 4) are the other poses that were
    considered for the pair, refined on few points, best first.
    """

    source: str
    target: str
    T_target_source: Array
    overlap: float
    trimmed_mse: float
    objective: float
    pairs: Indices
    distances: Array
    trim_distance: float
    iterations: int
    converged: bool
    alternatives: Array = field(default_factory=lambda: np.empty((0, 4, 4)))

    def __post_init__(self) -> None:
        checks.text("Registration.source", self.source)
        checks.text("Registration.target", self.target)
        checks.number("Registration.overlap", self.overlap, 0.0, 1.0)
        checks.length("Registration.trimmed_mse", self.trimmed_mse)
        checks.number("Registration.objective", self.objective)
        checks.length("Registration.trim_distance", self.trim_distance)
        checks.length("Registration.iterations", self.iterations)
        pairs = checks.integers("Registration.pairs", self.pairs, "P", 2)
        checks.keep(
            self,
            T_target_source=checks.pose("Registration.T_target_source", self.T_target_source),
            pairs=pairs,
            distances=checks.floats("Registration.distances", self.distances, len(pairs)),
            converged=checks.truth("Registration.converged", self.converged),
            alternatives=checks.poses("Registration.alternatives", self.alternatives),
        )


@dataclass(frozen=True)
class Verdict:
    """A judge's answer: `score` is what was measured (lower is better) against `threshold`.

    `confidence` is the probability that the pose is right, None where the judge cannot tell;
    `evidence` is what was measured, by name. `open_loop` says that the pose would be reliable by
    itself, but contradicts accepted registrations that lead from its source to its target.
    """

    reliable: bool
    score: float
    threshold: float
    reason: str
    confidence: float | None = None
    evidence: Mapping[str, float] = field(default_factory=dict)
    open_loop: bool = False

    def __post_init__(self) -> None:
        checks.number("Verdict.score", self.score)  # infinite where there was nothing to measure
        checks.number("Verdict.threshold", self.threshold)
        checks.instance("Verdict.reason", self.reason, str)
        checks.instance("Verdict.evidence", self.evidence, Mapping)
        if self.confidence is not None:
            checks.number("Verdict.confidence", self.confidence, 0.0, 1.0)
        checks.keep(
            self,
            reliable=checks.truth("Verdict.reliable", self.reliable),
            open_loop=checks.truth("Verdict.open_loop", self.open_loop),
        )
