"""Merge an accepted view into the model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, mean_spacing, nearest
from mvreg.types import Array, Features, Indices, Model, Part, Registration, View


class Mode(Enum):
    """How several source points that share one target point are merged.

    `many`: a midpoint for each, as the paper prints; `group`: one point for all of them, so that
    the model's density stays what it was.
    """

    many = "many"
    group = "group"


def moved(view: View, transform: Array) -> View:
    """The view in another frame: points, keypoints and all normals move, descriptors stay."""
    rotation = transform[:3, :3]
    features = replace(
        view.features,
        keypoints=se3.apply(transform, view.features.keypoints),
        normals=view.features.normals @ rotation.T,  # Eq. (12) rotates normals, not descriptors
    )
    return replace(
        view,
        points=se3.apply(transform, view.points),
        normals=view.normals @ rotation.T,
        features=features,
    )


def grown(model: Model, part: Part, points: Array, normals: Array, features: Features) -> Model:
    """The model with new contents and one more part."""
    tree = build_tree(points)
    new = Model(
        model.name,
        points,
        normals,
        features,
        mean_spacing(points, tree),  # d_Q, of the current model
        model.scale,
        parts=(*model.parts, part),
    )
    vars(new)["tree"] = tree  # what the cached property would build again
    return new


def joined(first: Features, second: Features) -> Features:
    """Both sets of keypoints, one after the other."""
    return Features(
        np.concatenate([first.keypoints, second.keypoints]),
        np.concatenate([first.normals, second.normals]),
        np.concatenate([first.descriptors, second.descriptors]),
        first.oriented and second.oriented,
        declared_by_both(first, second),
    )


def declared_by_both(first: Features, second: Features) -> float | None:
    """The spread of descriptors that both declare; None leaves it to be estimated from all."""
    return first.spread if first.spread == second.spread else None


@dataclass(frozen=True)
class ConcatAugment:
    """Put the moved view beside the model: everything is kept, twice where they overlap.

    The rude way of OCPRA: ``Q' = Q + P'``.
    """

    def __call__(self, model: Model, source: View, registration: Registration) -> Model:
        view = moved(source, registration.T_target_source)
        return grown(
            model,
            Part(source, registration.T_target_source),
            np.concatenate([model.points, view.points]),
            np.concatenate([model.normals, view.normals]),
            joined(model.features, view.features),
        )


def mean_normals(own: Array, other: Array, oriented: bool) -> Array:
    """Unit means of unit normals (..., 3); `own` wins where they cancel."""
    if not oriented:
        other = other * np.where((own * other).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    total = own + other
    norm = np.linalg.norm(total, axis=-1, keepdims=True)
    return np.where(norm > 1e-3, total / np.maximum(norm, 1e-3), own)


def merge(
    own: list[Array], other: list[Array], pairs: Indices, mode: Mode, oriented: bool
) -> list[Array]:
    """Fuse paired rows and keep the others: ``Q' = A + F + B``, Eqs. (8) to (13).

    Parameters
    ----------
    own, other : lists of arrays
        Rows of the model and of the moved view: positions first, normals second, the rest is
        averaged plainly.
    pairs : (P, 2) array
        Rows of `other` and of `own` that are one point of the surface.
    mode : Mode
        What to do where several rows share one of the model's.
    oriented : bool
        Whether the normals' signs mean anything.

    Returns
    -------
    list of arrays
        Eqs. (10), (13): A, the model's rows without partner; F, the fused; B, the view's others.
    """
    theirs, ours = pairs.T
    alone, new = unpaired(len(own[0]), ours), unpaired(len(other[0]), theirs)
    if mode is Mode.many:
        fused_own = [rows[ours] for rows in own]
        fused_other = [rows[theirs] for rows in other]
    else:
        unique, group = np.unique(ours, return_inverse=True)
        fused_own = [rows[unique] for rows in own]
        fused_other = [group_mean(rows[theirs], group, len(unique)) for rows in other]
        if not oriented:  # signs may differ within a group: take one member's normals
            first = np.unique(group, return_index=True)[1]
            fused_other[1] = other[1][theirs[first]]
    merged = []
    for column, (mine, yours) in enumerate(zip(fused_own, fused_other, strict=True)):
        normals = column == 1
        fused = mean_normals(mine, yours, oriented) if normals else (mine + yours) / 2
        merged.append(np.concatenate([own[column][alone], fused, other[column][new]]))
    return merged


def unpaired(count: int, paired: Indices) -> Indices:
    """Which of so many rows are in no pair."""
    alone = np.ones(count, dtype=bool)
    alone[paired] = False
    return np.flatnonzero(alone)


def group_mean(rows: Array, group: Indices, count: int) -> Array:
    """Mean of the rows (P, ...) of each of `count` groups."""
    total = np.zeros((count, *rows.shape[1:]))
    np.add.at(total, group, rows)
    size = np.bincount(group, minlength=count).reshape(-1, *([1] * (rows.ndim - 1)))
    mean: Array = total / size
    return mean


@dataclass(frozen=True)
class MergeAugment:
    """Fuse what overlaps and add what is new, Eqs. (8) to (13), so that the model stays small.

    Points are paired by the registration's trimmed pairs. Keypoints are paired by their own nearest
    neighbours, not farther than the largest trimmed distance (as in the authors' published code).
    Descriptors are averaged, normals rotated, averaged and brought back to unit length. Departing
    from the paper, points whose normals oppose each other are two sides of something thin and are
    not fused.

    Parameters
    ----------
    mode : Mode
        `many` is the paper's.
    """

    mode: Mode = Mode.many

    def __call__(self, model: Model, source: View, registration: Registration) -> Model:
        view = moved(source, registration.T_target_source)
        oriented = model.features.oriented and view.features.oriented
        pairs = same_side(registration.pairs, view.normals, model.normals, oriented)
        points, normals = merge(
            [model.points, model.normals], [view.points, view.normals], pairs, self.mode, oriented
        )
        own, other = model.features, view.features
        # A query's bound is exclusive, and a scan given twice is trimmed at zero.
        reach = max((1 + 1e-9) * registration.trim_distance, 1e-9 * model.scale.spacing)
        distances, indices = nearest(model.keypoint_tree, other.keypoints, reach)
        close = np.flatnonzero(np.isfinite(distances))
        pairs = np.stack([close, indices[close]], axis=1)
        pairs = same_side(pairs, other.normals[:, 0], own.normals[:, 0], oriented)
        keypoints, facing, descriptors = merge(
            [own.keypoints, own.normals, own.descriptors],
            [other.keypoints, other.normals, other.descriptors],
            pairs,
            self.mode,
            oriented,
        )
        spread = declared_by_both(own, other)
        features = Features(keypoints, facing, descriptors, oriented, spread)
        part = Part(source, registration.T_target_source)
        return grown(model, part, points, normals, features)


def same_side(pairs: Indices, source: Array, target: Array, oriented: bool) -> Indices:
    """The pairs (P, 2) whose normals do not oppose each other."""
    if not oriented:
        return pairs
    facing = (source[pairs[:, 0]] * target[pairs[:, 1]]).sum(axis=1) >= 0
    same: Indices = pairs[facing]
    return same
