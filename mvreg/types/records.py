"""The records that stages exchange: matches, candidates, registrations, results.

Public as part of `mvreg.types`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from mvreg.geometry.arrays import Array, Indices
from mvreg.types.view import Model, View


@dataclass(frozen=True, eq=False)
class Matches:
    """Index pairs `indices` (M, 2) of source and target keypoints, best first.

    `distances` (M,) are the descriptor distances.
    """

    indices: Indices
    distances: Array

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


@dataclass(frozen=True, eq=False)
class Pair:
    """The record of one attempted pair-wise registration; a row of ``pairs.csv``.

    `T_target_source`, `overlap` and `trimmed_mse` are None where there was no candidate;
    `seconds` maps a stage's kind to the time that it took.
    """

    source: str
    target: str
    verdict: Verdict
    T_target_source: Array | None = None
    overlap: float | None = None
    trimmed_mse: float | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Link:
    """Two placed scans that overlap, under the poses of a result.

    `points` of the source lie on the target's surface, at a root mean square point-to-plane
    distance of `rms` (length).
    """

    source: str
    target: str
    points: int
    rms: float


@dataclass(frozen=True, eq=False)
class Result:
    """Every pose that was found.

    `poses` maps names to ``T_model_scan`` (4, 4), the identity for `reference`. `components` are
    the other partial models, which nothing reliable joins to the reference's: each maps names to
    poses in a frame of its own, that of its first scan. `unregistered` names the scans in neither.
    `pairs` has every attempt, in order; `model` is the merged view where the strategy keeps one.
    An `adjust` stage may add the `covariances` (6, 6) of the poses, of small motions
    ``exp(twist) @ T_model_scan``, three of rotation (radians) and three of translation (length),
    and the `links` that it rests on. `views` are the scans as they were prepared, in the order in
    which they were given; `mvreg.register` fills them in, strategies leave them empty.
    """

    reference: str
    poses: Mapping[str, Array]
    unregistered: tuple[str, ...]
    pairs: tuple[Pair, ...]
    model: Model | None = None
    components: tuple[Mapping[str, Array], ...] = ()
    covariances: Mapping[str, Array] = field(default_factory=dict)
    links: tuple[Link, ...] = ()
    views: tuple[View, ...] = field(default=(), repr=False)
