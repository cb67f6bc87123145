"""Scans prepared for registration, and the model that they are merged into.

Public as part of `mvreg.types`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mvreg.geometry.arrays import Array
from mvreg.types.lazy import lazy
from mvreg.types.scan import Scan

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree


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


#: So many descriptors at most are compared with each other, to estimate their spread.
COMPARED = 250


def typical_distance(descriptors: Array) -> float:
    """Median distance between two of the rows (K, D); 1 where all are alike, or fewer than two.

    All pairs are compared among at most `COMPARED` rows, evenly picked in lexicographic order, so
    that the order of the rows does not matter and nothing is drawn at random.
    """
    rows = descriptors[np.lexsort(descriptors.T[::-1])] if len(descriptors) else descriptors
    rows = rows[:: -(-len(rows) // COMPARED) or 1]
    first, second = np.triu_indices(len(rows), 1)
    distances = np.linalg.norm(rows[first] - rows[second], axis=1)
    if not distances.any():
        return 1.0
    return float(np.median(distances) or distances.mean())


@dataclass(frozen=True, eq=False)
class Features:
    """Described keypoints of one scan.

    `keypoints` (K, 3); `normals` (K, L, 3), unit, one per scale; `descriptors` (K, D), invariant
    under rigid motion; `oriented` is False where the normals' signs mean nothing.
    `declared_spread` is the typical distance between the descriptors of two unlike keypoints, if
    the stage that made them knows it from many scans; the same for all views of a run.

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
    declared_spread: float | None = None

    @lazy
    def spread(self) -> float:
        """The unit that tolerances of descriptors are in: typically, unlike keypoints are 1 apart.

        As declared, else the median distance between two of these descriptors. Always positive.
        """
        if self.declared_spread is not None:
            return self.declared_spread
        return typical_distance(self.descriptors)


@dataclass(frozen=True, eq=False)
class View:
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


@dataclass(frozen=True, eq=False)
class Part:
    """A view in a model, and where it is: `T_model_scan` (4, 4)."""

    view: View
    T_model_scan: Array


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

    @classmethod
    def of(cls, view: View) -> Model:
        """The model that consists of one view, in that view's frame."""
        return cls(
            view.name, view.points, view.normals, view.features, view.resolution, view.scale,
            parts=(Part(view, np.eye(4)),),
        )  # fmt: skip
