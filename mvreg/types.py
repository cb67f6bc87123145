"""The records that pass between the stages.

All are frozen. Lengths are in the unit of the scans, which no stage needs to know; transforms are
4x4, ``x_target = T_target_source @ x_source``. Arrays are float64 and must not be written to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mvreg import se3
from mvreg.errors import InputError

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Scan:
    """Raw points of one range scan, in a frame of their own.

    Parameters
    ----------
    name : str
        Unique within a set; the file's name where there is one.
    points : (N, 3) array
        Finite coordinates, N >= 1.
    view_direction : (3,) array, optional
        Unit vector from the surface towards the sensor, for a sensor far away or orthographic.
    view_point : (3,) array, optional
        The sensor's position, for a central projection.

    Raises
    ------
    InputError
        If the points are not (N, 3), not finite or none at all.
    """

    name: str
    points: Array
    view_direction: Array | None = None
    view_point: Array | None = None

    def __post_init__(self) -> None:
        try:
            points = np.array(self.points, dtype=np.float64, order="C")
        except (TypeError, ValueError):
            raise InputError(
                f"scan {self.name!r}: expected points as an array (N, 3) of numbers, got "
                f"{type(self.points).__name__}"
            ) from None
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"scan {self.name!r}: expected points (N, 3), got {points.shape}")
        if len(points) == 0:
            raise InputError(f"scan {self.name!r}: expected at least one point, got none")
        if not np.isfinite(points).all():
            bad = int((~np.isfinite(points).all(axis=1)).sum())
            raise InputError(
                f"scan {self.name!r}: {bad} of {len(points)} points are NaN or infinite; "
                "drop them first"
            )
        points.flags.writeable = False  # the trees and the views share them
        object.__setattr__(self, "points", points)
        for key in ("view_direction", "view_point"):
            vector = getattr(self, key)
            if vector is None:
                continue
            vector = np.array(vector, dtype=np.float64)
            if vector.shape != (3,) or not np.isfinite(vector).all():
                raise InputError(f"scan {self.name!r}: expected {key} of 3 numbers, got {vector}")
            object.__setattr__(self, key, vector)
        if self.view_direction is not None:
            norm = np.linalg.norm(self.view_direction)
            if norm == 0:
                raise InputError(f"scan {self.name!r}: view_direction is the zero vector")
            object.__setattr__(self, "view_direction", self.view_direction / norm)

    @cached_property
    def tree(self) -> cKDTree:
        """k-d tree over `points`."""
        from mvreg.nearest import build_tree

        return build_tree(self.points)

    @property
    def knows_sensor(self) -> bool:
        """Whether the sensor's direction or position is known."""
        return self.view_direction is not None or self.view_point is not None

    def moved(self, transform: Array) -> Scan:
        """The same scan in another frame: points and sensor move together."""
        direction, point = self.view_direction, self.view_point
        return replace(
            self,
            points=se3.apply(transform, self.points),
            view_direction=None if direction is None else transform[:3, :3] @ direction,
            view_point=None if point is None else se3.apply(transform, point[None])[0],
        )


@dataclass(frozen=True, eq=False)
class ScanSet:
    """What a data set hands over: scans in the order given, and the truth where it is known.

    `poses` maps scan names to ground truth ``T_world_scan`` (4, 4); it may miss scans.
    `unit` is the unit of length ("mm"), or "file" for the files' own, whatever it is.
    """

    name: str
    scans: tuple[Scan, ...]
    unit: str = "file"
    poses: Mapping[str, Array] | None = None


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
    `resolution` is the mean nearest-neighbour distance of `points`, the paper's d_Q.
    """

    name: str
    points: Array
    normals: Array
    features: Features
    resolution: float
    scale: Scale

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
            (view.name,),
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
