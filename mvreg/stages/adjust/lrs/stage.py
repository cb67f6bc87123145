"""All poses from many relative motions at once, outliers among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages.adjust import view_graph
from mvreg.stages.adjust.components import over_components
from mvreg.stages.adjust.lrs import decomposition
from mvreg.surface.displacement import fixes_pose
from mvreg.types import Array, Edge, Result, View
from mvreg.types.view_graph import reachable


@dataclass(frozen=True)
class LowRankSparse:
    """Re-register all overlapping pairs of views, and reject the outliers among their motions.

    LRS of Arrigoni, Rossi and Fusiello (ECCV 2016), with their L1-ALM: the relative motions make a
    matrix of rank 4, of which some blocks are missing and a few grossly wrong; the matrix of rank 4
    with the least sum of absolute differences has the poses in the reference's block row. A pair
    refined one way only serves the other way too. Views that no path of measured pairs joins to the
    reference keep their poses, and so do all if the new ones contradict the motions more than the
    old.

    Parameters
    ----------
    min_overlap : float
        Pairs that share more than this, see `view_graph.overlaps`, are measured: 0.5 in Li and Zhu,
        3DV 2014; Arrigoni et al. give none.
    weighted : bool
        Pairs count by ``resolution^2 / TMSE^2``, the largest as one, after Jin et al., "Multi-view
        registration based on weighted low rank and sparse matrix decomposition of motions", IET
        Computer Vision. Off, as in Arrigoni et al.
    complete : bool
        Fill pairs that were not measured with the product of two that were, those that weigh most,
        as Jin et al. do. Off, as in Arrigoni et al.
    """

    min_overlap: float = 0.5
    weighted: bool = False
    complete: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.min_overlap < 1:
            raise InputError(
                f"adjust.min_overlap: expected a share in [0, 1), got {self.min_overlap}"
            )

    def __call__(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        return over_components(result, lambda part: self.improved(part, views, pipeline))

    def improved(self, result: Result, views: Sequence[View], pipeline: Pipeline) -> Result:
        """Adjust one partial model with its reference fixed."""
        placed = [view for view in views if view.name in result.poses and fixes_pose(view.points)]
        names = [view.name for view in placed]
        if result.reference not in names:
            return result
        edges = view_graph.edges(result, placed, pipeline.refine, self.min_overlap)
        reference = names.index(result.reference)
        joined = sorted(reachable(((e.target, e.source) for e in edges), reference))
        edges = [
            replace(edge, target=joined.index(edge.target), source=joined.index(edge.source))
            for edge in edges
            if edge.target in joined and edge.source in joined
        ]
        found = self.solve(result, [placed[index] for index in joined], edges) if edges else None
        return result if found is None else replace(result, poses=found, model=None)

    def solve(
        self, result: Result, views: Sequence[View], edges: Sequence[Edge]
    ) -> dict[str, Array] | None:
        """All poses, those of `views` new; None if the old ones suit the edges better."""
        names = [view.name for view in views]
        poses = np.stack([result.poses[name] for name in names])
        scene, size = frame_of(
            np.concatenate([se3.apply(p, v.points) for p, v in zip(poses, views, strict=True)])
        )
        relative, weights = self.blocks(views, edges)
        relative, start = shrunk(relative, size), shrunk(scene @ poses, size)
        found = decomposition.synchronise(relative, weights, start, names.index(result.reference))
        before, after = (contradiction(relative, weights, p) for p in (start, found))
        if not after <= before:
            return None
        new = dict(result.poses)
        for name, pose in zip(names, se3.invert(scene) @ shrunk(found, 1 / size), strict=True):
            if name != result.reference:
                new[name] = se3.project(pose)
        return new

    def blocks(self, views: Sequence[View], edges: Sequence[Edge]) -> tuple[Array, Array]:
        """Relative motions (N, N, 4, 4) and how much each counts (N, N), 0 for none."""
        count = len(views)
        relative = np.tile(np.eye(4), (count, count, 1, 1))
        weights = np.zeros((count, count))
        for edge, weight in zip(edges, self.weights(views, edges), strict=True):
            i, j = edge.target, edge.source
            relative[i, j], weights[i, j] = edge.T_target_source, weight
        for i, j in np.argwhere((weights > 0).T & (weights == 0)):
            relative[i, j], weights[i, j] = se3.invert(relative[j, i]), weights[j, i]
        return completed(relative, weights) if self.complete else (relative, weights)

    def weights(self, views: Sequence[View], edges: Sequence[Edge]) -> Array:
        """The weight of each edge (E,), at most one."""
        if not self.weighted:
            return np.ones(len(edges))
        # Motions that fit to a thousandth of the resolution are exact: no weight without bound.
        least = 1e-6 * np.array([views[edge.target].scale.resolution ** 2 for edge in edges])
        errors = np.maximum([edge.trimmed_mse for edge in edges], least)
        found = (np.array([views[edge.target].resolution for edge in edges]) / errors) ** 2
        shares: Array = found / found.max()
        return shares


def completed(relative: Array, weights: Array) -> tuple[Array, Array]:
    """Fill in missing motions from two known ones, via the view of the largest weight product.

    The product of the two weights becomes the weight.
    """
    relative, known = relative.copy(), weights
    weights = weights.copy()
    for i, j in np.argwhere(known == 0):
        products = known[i] * known[:, j]
        by = int(products.argmax())
        if i != j and products[by] > 0:
            relative[i, j], weights[i, j] = relative[i, by] @ relative[by, j], products[by]
    return relative, weights


def frame_of(points: Array) -> tuple[Array, float]:
    """``T_scene_model`` (4, 4) of the principal axes of points (N, 3), and their RMS radius.

    Sums of absolute differences depend on the axes: these are the scene's own.
    """
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre, full_matrices=False)
    if np.linalg.det(axes) < 0:
        axes = -axes
    size = float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean()))
    return se3.from_parts(axes, -axes @ centre), size if size > 0 else 1.0


def shrunk(poses: Array, size: float) -> Array:
    """Motions (..., 4, 4) in lengths of `size`."""
    return se3.from_parts(poses[..., :3, :3], poses[..., :3, 3] / size)


def contradiction(relative: Array, weights: Array, poses: Array) -> float:
    """The weighted sum of absolute differences between relative motions and poses."""
    rest = poses[:, None] @ relative @ se3.invert(poses)[None] - np.eye(4)
    return float((weights[..., None, None] * np.abs(rest)).sum())
