"""Scans prepared for registration, and the model that they are merged into.

Public as part of `mvreg.types`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mvreg.errors import RecordError
from mvreg.geometry.arrays import Array
from mvreg.types import checks
from mvreg.types.lazy import FieldsAlone, lazy
from mvreg.types.scan import Scan

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree

#: The share of the descriptors that lie within their spread of the median.
WITHIN_SPREAD = 0.75


@dataclass(frozen=True)
class Scale:
    """The two lengths that every parameter is relative to, common to all the scans of a run.

    `spacing` is the grid step of the keypoints (the paper's sampling, g); `resolution` the median
    over the scans of the mean nearest-neighbour distance of their registration points.
    """

    spacing: float
    resolution: float

    def __post_init__(self) -> None:
        checks.length("Scale.spacing", self.spacing)
        checks.length("Scale.resolution", self.resolution)


@dataclass(frozen=True, eq=False)
class Sample:
    """One scan down-sampled: registration points (N, 3) and keypoint candidates (K, 3)."""

    points: Array
    keypoints: Array

    def __post_init__(self) -> None:
        checks.keep(
            self,
            points=checks.floats("Sample.points", self.points, "N", 3),
            keypoints=checks.floats("Sample.keypoints", self.keypoints, "K", 3),
        )


@dataclass(frozen=True, eq=False)
class Features:
    """Described keypoints of one scan.

    `keypoints` (K, 3); `normals` (K, L, 3), unit, one per scale; `descriptors` (K, D), invariant
    under rigid motion; `oriented` is False where the normals' signs mean nothing.

    `spread` says how far apart descriptors of this kind lie, in their own unit: tolerances on
    distances of descriptors are relative to it. A stage may declare it, as a constant measured on
    many scans, common to all it describes; None leaves it to be estimated from the descriptors,
    see `descriptor_spread`.

    The scales ascend, and the first, ``normals[:, 0]``, is the normal of a keypoint wherever one is
    needed: to turn registration points' normals to the same side, to merge a view into the model.
    Propagation compares the normals of all scales; the overlap score of `best_first` takes a side
    from the last. Where `oriented`, each of them points to the side that the sensor was on, as far
    as that can be told. Keypoints are in no particular order; there may be none (K = 0).
    """

    keypoints: Array
    normals: Array
    descriptors: Array
    oriented: bool
    spread: float | None = None

    def __post_init__(self) -> None:
        keypoints = checks.floats("Features.keypoints", self.keypoints, "K", 3)
        count = len(keypoints)
        if self.spread is not None and not 0 < self.spread < np.inf:
            raise RecordError(f"Features.spread: expected a number above 0, got {self.spread}")
        checks.keep(
            self,
            keypoints=keypoints,
            normals=checks.unit("Features.normals", self.normals, count, "L", 3),
            descriptors=checks.floats("Features.descriptors", self.descriptors, count, "D"),
            oriented=checks.truth("Features.oriented", self.oriented),
        )

    @lazy
    def descriptor_spread(self) -> float:
        """`spread` as declared, or else `estimated_spread` of the descriptors (their unit)."""
        return estimated_spread(self.descriptors) if self.spread is None else self.spread


def estimated_spread(descriptors: Array) -> float:
    """Radius of the ball about the component-wise median that holds three quarters of the rows.

    A robust measure, in the unit of the descriptors: it grows with them, does not depend on their
    order, and a quarter of the rows may be anything.

    Parameters
    ----------
    descriptors : (K, D) array

    Returns
    -------
    float
        0 where there are none, or where three quarters are all alike.
    """
    if not descriptors.size:
        return 0.0
    away = np.linalg.norm(descriptors - np.median(descriptors, axis=0), axis=1)
    return float(np.quantile(away, WITHIN_SPREAD))


def common_spread(first: Features, second: Features) -> float:
    """What tolerances on distances between the descriptors of two views are relative to.

    The root mean square of the two spreads, so that source and target may change places; exactly
    the declared one where both declare the same. Infinite where both are zero: descriptors that
    are all alike tell nothing apart, and exclude nothing.
    """
    own, other = first.descriptor_spread, second.descriptor_spread
    if own == other:
        return own or np.inf
    return float(np.hypot(own, other) / np.sqrt(2))


@dataclass(frozen=True, eq=False)
class View(FieldsAlone):
    """A scan prepared for registration, or the merged model, in a frame of its own.

    `points` (N, 3) with unit `normals` (N, 3) for refinement; `features` for the search;
    `resolution` is the mean nearest-neighbour distance of `points`, the paper's d_Q. `scan` has all
    the raw points in the same frame, and what is known of the sensor; None for a merged view.
    Points are in no particular order and may be none (N = 0); `resolution` is then 0. Which way the
    normals point is known only where `features.oriented`.
    """

    name: str
    points: Array
    normals: Array
    features: Features
    resolution: float
    scale: Scale
    scan: Scan | None = None

    def __post_init__(self) -> None:
        name = type(self).__name__
        checks.text(f"{name}.name", self.name)
        checks.instance(f"{name}.features", self.features, Features)
        checks.instance(f"{name}.scale", self.scale, Scale)
        checks.length(f"{name}.resolution", self.resolution)
        points = checks.floats(f"{name}.points", self.points, "N", 3)
        checks.instance(f"{name}.normals", self.normals, np.ndarray)
        checks.check_shape(f"{name}.normals", self.normals, (len(points), 3))
        checks.keep(self, points=points)

    @lazy
    def tree(self) -> Tree:
        """k-d tree over `points`."""
        from mvreg.geometry.nearest import build_tree

        return build_tree(self.points)

    @lazy
    def keypoint_tree(self) -> Tree:
        """k-d tree over the keypoints."""
        from mvreg.geometry.nearest import build_tree

        return build_tree(self.features.keypoints)

    @property
    def up(self) -> Array | None:
        """Unit vector (3,) against gravity in the view's frame; None where it is not known."""
        return None if self.scan is None else self.scan.up


@dataclass(frozen=True, eq=False)
class Part:
    """A view in a model, and where it is: `T_model_scan` (4, 4)."""

    view: View
    T_model_scan: Array

    def __post_init__(self) -> None:
        checks.instance("Part.view", self.view, View)
        checks.keep(self, T_model_scan=checks.pose("Part.T_model_scan", self.T_model_scan))


@dataclass(frozen=True, eq=False)
class Model(View):
    """The merged view in the model frame, and the views that it is made of, in order.

    `parts` are as they were when they were merged in: what each sensor saw is not lost. The model
    has the name of the first of them, whose frame is the model frame: what is registered to the
    model is recorded as registered to that scan. A model is told by its type, never by its name.
    """

    parts: tuple[Part, ...] = ()

    @property
    def members(self) -> tuple[str, ...]:
        """The names of the parts, in order."""
        return tuple(part.view.name for part in self.parts)

    @property
    def up(self) -> Array | None:
        """The vertical (3,) of the first of the parts that has one, in the model frame."""
        for part in self.parts:
            if (up := part.view.up) is not None:
                return part.T_model_scan[:3, :3] @ up
        return None

    @classmethod
    def of(cls, view: View) -> Model:
        """The model that consists of one view, in that view's frame."""
        return cls(
            view.name, view.points, view.normals, view.features, view.resolution, view.scale,
            parts=(Part(view, np.eye(4)),),
        )  # fmt: skip
