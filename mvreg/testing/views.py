"""Prepared views for tests: overlapping ones, and degenerate ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import TypeVar

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import mean_spacing
from mvreg.pipeline import Pipeline
from mvreg.stages.augment.merge import MergeAugment
from mvreg.stages.describe.spectrum import SpectrumDescribe
from mvreg.stages.downsample.sampling import PaperDownsample
from mvreg.stages.judge.residual import PointToPlaneJudge
from mvreg.stages.propagate.consensus import ConsensusPropagate
from mvreg.stages.refine.trimmed import TrimmedICP
from mvreg.stages.seed.nearest import NearestSeed
from mvreg.testing.compare import locked
from mvreg.testing.scans import blob_scans, degenerate_points
from mvreg.types import Array, Edge, Features, Indices, Registration, Scale, Scan, View, ViewGraph

#: What suits scans of a few thousand points.
SMALL = PaperDownsample(stride=2, keypoint_ratio=12, min_points=1, min_keypoints=1)

AnyView = TypeVar("AnyView", bound=View)

#: Turns the axes into each other: exact in floating point, so that only wrong signs and frames
#: show, not rounding.
AXES_SWAPPED = se3.from_parts(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.zeros(3))
#: Any rigid motion.
MOTION = se3.random(np.random.default_rng(11), 300.0)
#: Other units of length. Powers of two are exact in floating point, so that the answer must be too.
UNITS = (1024.0, 1 / 1024)


def pipeline() -> Pipeline:
    """The core's own stages, with parameters that suit the small scans of this package."""
    return Pipeline(
        downsample=SMALL,
        describe=SpectrumDescribe(),
        seed=NearestSeed(),
        propagate=ConsensusPropagate(keep=5),
        refine=TrimmedICP(),
        judge=PointToPlaneJudge(),
        augment=MergeAugment(),
    )


@dataclass(frozen=True, eq=False)
class Overlap:
    """Two views that overlap, and ``T_target_source`` (4, 4), exact."""

    source: View
    target: View
    T_target_source: Array


@cache
def blob_views(count: int = 3) -> tuple[View, ...]:
    """Views of `blob_scans`, prepared; the same at every call, and read-only."""
    views = pipeline().prepare(blob_scans(count).scans, np.random.default_rng(0))
    made: tuple[View, ...] = locked(tuple(views))
    return made


@cache
def overlap() -> Overlap:
    """Two views of the blob, 40 degrees apart."""
    source, target = blob_views()[:2]
    poses = blob_scans(3).poses or {}
    return Overlap(source, target, se3.invert(poses[target.name]) @ poses[source.name])


def plain_view(name: str, points: Array, scale: Scale, keypoints: int = 50) -> View:
    """A view of `points` (N, 3) whose features say nothing: all alike, upwards, none if asked.

    For degenerate cases; the shapes are those of the blob's views.
    """
    sample = overlap().source.features
    chosen = points[:keypoints]
    up = np.array([0.0, 0.0, 1.0])
    features = Features(
        chosen,
        np.tile(up, (len(chosen), sample.normals.shape[1], 1)),
        np.zeros((len(chosen), sample.descriptors.shape[1])),
        oriented=True,
        spread=sample.spread,
    )
    normals = np.tile(up, (len(points), 1))
    return View(name, points, normals, features, mean_spacing(points), scale)


@cache
def degenerate_views() -> dict[str, View]:
    """Views that cannot be registered, by what is wrong with them."""
    good = overlap().source
    views = {
        name: plain_view("poor", points, good.scale) for name, points in degenerate_points().items()
    }
    views["no keypoints"] = plain_view("poor", good.points, good.scale, keypoints=0)
    views["one keypoint"] = plain_view("poor", good.points, good.scale, keypoints=1)
    views["far away"] = moved_view(good, se3.from_parts(np.eye(3), np.full(3, 1e6)))
    return views


def degenerate_pairs() -> dict[str, tuple[View, View]]:
    """Every degenerate view as source, as target and as both."""
    good = overlap()
    pairs = {}
    for name, view in degenerate_views().items():
        pairs[f"source: {name}"] = (view, good.target)
        pairs[f"target: {name}"] = (good.source, view)
        pairs[f"both: {name}"] = (view, replace(view, name="other"))
    return pairs


def moved_view(view: AnyView, transform: Array) -> AnyView:
    """The view in another frame: points, keypoints and normals move, descriptors stay."""
    old, turn = view.features, transform[:3, :3].T
    features = replace(
        old, keypoints=se3.apply(transform, old.keypoints), normals=old.normals @ turn
    )
    points = se3.apply(transform, view.points)
    scan = view.scan and view.scan.moved(transform)
    return replace(view, points=points, normals=view.normals @ turn, features=features, scan=scan)


def scaled_scan(scan: Scan, factor: float) -> Scan:
    """The scan in another unit of length."""
    point = None if scan.view_point is None else scan.view_point * factor
    return replace(scan, points=scan.points * factor, view_point=point)


def scaled_view(view: AnyView, factor: float) -> AnyView:
    """The view in another unit of length."""
    return replace(
        view,
        points=view.points * factor,
        features=replace(view.features, keypoints=view.features.keypoints * factor),
        resolution=view.resolution * factor,
        scale=Scale(view.scale.spacing * factor, view.scale.resolution * factor),
        scan=view.scan and scaled_scan(view.scan, factor),
    )


def rescaled_descriptors(view: AnyView, factor: float) -> AnyView:
    """The view with descriptors in another unit, and their spread with them."""
    old = view.features
    spread = old.spread and old.spread * factor
    return replace(view, features=replace(old, descriptors=old.descriptors * factor, spread=spread))


def scaled_pose(transform: Array, factor: float) -> Array:
    """The same pose (4, 4) in another unit of length."""
    return se3.from_parts(transform[:3, :3], transform[:3, 3] * factor)


def shuffled_view(view: AnyView, number: int) -> tuple[AnyView, Indices, Indices]:
    """The view with points and keypoints in another order, and the two orders: new to old."""
    rng = np.random.default_rng(number)
    points, keypoints = (rng.permutation(len(x)) for x in (view.points, view.features.keypoints))
    old = view.features
    features = replace(
        old,
        keypoints=old.keypoints[keypoints],
        normals=old.normals[keypoints],
        descriptors=old.descriptors[keypoints],
    )
    new = replace(view, points=view.points[points], normals=view.normals[points], features=features)
    return new, points, keypoints


def registration(
    source: View, target: View, transform: Array, reach: float | None = None
) -> Registration:
    """The registration record of a pose (4, 4): its pairs within `reach` (length), at least one.

    `reach` is twice the target's resolution if not given.
    """
    distances, indices = target.tree.query(se3.apply(transform, source.points))
    reach = 2 * target.resolution if reach is None else reach
    chosen = np.argsort(distances, kind="stable")
    chosen = chosen[: max(1, int((distances <= reach).sum()))]
    kept = distances[chosen]
    overlap, mse = len(chosen) / len(source.points), float((kept**2).mean())
    return Registration(
        source.name, target.name, transform, overlap, mse, mse / overlap**3,
        np.stack([chosen, indices[chosen]], axis=1), kept, float(kept[-1]), 1, True,
    )  # fmt: skip


def scaled_registration(found: Registration, factor: float) -> Registration:
    """The same registration in another unit of length."""
    return replace(
        found,
        T_target_source=scaled_pose(found.T_target_source, factor),
        trimmed_mse=found.trimmed_mse * factor**2,
        objective=found.objective * factor**2,
        distances=found.distances * factor,
        trim_distance=found.trim_distance * factor,
    )


def graph_of(*registrations: Registration) -> ViewGraph:
    """The view graph of registrations between scans, under the names that they give."""
    return ViewGraph(
        tuple(
            Edge(one.source, one.target, one.T_target_source, one.overlap, one.trimmed_mse)
            for one in registrations
        )
    )
