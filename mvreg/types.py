"""The records that pass between the stages.

All are frozen. Lengths are in the unit of the scans, which no stage needs to know; transforms are
4x4, ``x_target = T_target_source @ x_source``. Arrays are float64 and must not be written to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mvreg.scan import Array as Array
from mvreg.scan import Scan as Scan
from mvreg.scan import ScanSet as ScanSet

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Scale:
    """The two lengths that every parameter is relative to, common to all the scans of a run.

    `spacing` is the grid step of the keypoints (the paper's sampling, g); `resolution` the median
    over the scans of the mean nearest-neighbour distance of their registration points.
    """

    spacing: float
    resolution: float


@dataclass(frozen=True, eq=False)
class Sample:
    """One scan down-sampled: registration points (N, 3) and keypoint candidates (K, 3)."""

    points: Array
    keypoints: Array


@dataclass(frozen=True, eq=False)
class Features:
    """Described keypoints of one scan.

    `keypoints` (K, 3); `normals` (K, L, 3), unit, one per scale; `descriptors` (K, D), invariant
    under rigid motion; `oriented` is False where the normals' signs mean nothing.
    """

    keypoints: Array
    normals: Array
    descriptors: Array
    oriented: bool


@dataclass(frozen=True, eq=False)
class View:
    """A scan prepared for registration, or the merged model, in a frame of its own.

    `points` (N, 3) with unit `normals` (N, 3) for refinement; `features` for the search;
    `resolution` is the mean nearest-neighbour distance of `points`, the paper's d_Q. `scan` has all
    the raw points in the same frame, and what is known of the sensor; None for a merged view.
    """

    name: str
    points: Array
    normals: Array
    features: Features
    resolution: float
    scale: Scale
    scan: Scan | None = None

    @cached_property
    def tree(self) -> cKDTree:
        """k-d tree over `points`."""
        from mvreg.nearest import build_tree

        return build_tree(self.points)

    @cached_property
    def keypoint_tree(self) -> cKDTree:
        """k-d tree over the keypoints."""
        from mvreg.nearest import build_tree

        return build_tree(self.features.keypoints)


@dataclass(frozen=True, eq=False)
class Model(View):
    """The merged view in the model frame, and the names of the scans in it, in order."""

    members: tuple[str, ...] = ()

    @classmethod
    def of(cls, view: View) -> Model:
        """The model that consists of one view, in that view's frame."""
        return cls(
            "model", view.points, view.normals, view.features, view.resolution, view.scale,
            members=(view.name,),
        )  # fmt: skip


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
    `trim_distance` the largest length kept.
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


@dataclass(frozen=True)
class Verdict:
    """A judge's answer: `score` is what was measured (lower is better) against `threshold`."""

    reliable: bool
    score: float
    threshold: float
    reason: str


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
class Result:
    """Every pose that was found.

    `poses` maps names to ``T_model_scan`` (4, 4), the identity for `reference`; `unregistered`
    names the scans that were not placed; `pairs` has every attempt, in order. `model` is the
    merged view where the strategy keeps one.
    """

    reference: str
    poses: Mapping[str, Array]
    unregistered: tuple[str, ...]
    pairs: tuple[Pair, ...]
    model: Model | None = None
