"""Coarse to fine: grow a model, then refine each scan in turn against all the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.geometry.nearest import mean_spacing
from mvreg.kernels.trimmed_pairs import trimmed
from mvreg.stages.strategy.grow import GrowStrategy, careful_levels
from mvreg.surface.displacement import STILL, farthest
from mvreg.types import Array, Features, Model, Part, Result, View

#: Of the score: smallest overlap and the paper's lambda, as in `TrimmedICP`.
MIN_OVERLAP, EXPONENT = 0.4, 2.0


def union(views: Sequence[View], poses: Mapping[str, Array], without: str) -> Model:
    """All the points of the placed views but one, in the model frame; nothing to search by.

    A model of them, so that it has their vertical.
    """
    others = [view for view in views if view.name in poses and view.name != without]
    points = np.concatenate([se3.apply(poses[view.name], view.points) for view in others])
    turned = [view.normals @ poses[view.name][:3, :3].T for view in others]
    features = Features(np.empty((0, 3)), np.empty((0, 1, 3)), np.empty((0, 1)), oriented=False)
    spacing = mean_spacing(points)
    return Model(
        others[0].name, points, np.concatenate(turned), features, spacing, views[0].scale,
        parts=tuple(Part(view, poses[view.name]) for view in others),
    )  # fmt: skip


def objective(poses: Mapping[str, Array], views: Sequence[View]) -> float:
    """How far the placed scans are from each other: ``sum_i min psi_i / N`` (length^2).

    The objective of Zhu et al. 2014 and of Li and Zhu, 3DV 2014: psi of Eq. (4) for each scan
    against the union of all the others, its best overlap found exactly. It needs no truth; smaller
    is better. Zero where fewer than two scans are placed.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``.
    views : sequence of View
        Those without pose or points are left out.
    """
    placed = [view for view in views if view.name in poses and len(view.points)]
    if len(placed) < 2:
        return 0.0
    total = 0.0
    for view in placed:
        others, bound = union(placed, poses, view.name), 4 * view.scale.spacing
        moved = se3.apply(poses[view.name], view.points)
        total += trimmed(others.tree, moved, bound, MIN_OVERLAP, 1 + EXPONENT).psi
    return total / len(placed)


@dataclass(frozen=True)
class CoarseToFineStrategy:
    """Grow a model, then refine each scan in turn against all the others, until poses stand still.

    After Zhu et al. 2014, Optical Engineering 53(10) 102104: coarse poses come from elsewhere,
    here from growing a model, see `GrowStrategy`; a round refines every scan but the reference, by
    the pipeline's refinement, against the union of all the others under their current poses, each
    new pose being used at once. The paper does not say what to do when that ends farther from
    agreement than it began; here the coarse poses then stay, by `objective`.

    Parameters
    ----------
    levels : list of mappings
        Of the growing, as in `GrowStrategy`.
    max_rounds : int
        Most rounds; 30, as many as motion averaging is given in the same group's code.
    """

    levels: list[dict[str, Any]] = field(default_factory=careful_levels)
    max_rounds: int = 30

    def __post_init__(self) -> None:
        GrowStrategy(self.levels)  # checks the levels
        if self.max_rounds < 0:
            raise InputError(f"strategy.max_rounds: expected 0 or more, got {self.max_rounds}")

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        coarse = GrowStrategy(self.levels)(views, pipeline, rng)
        placed = [view for view in views if view.name in coarse.poses and len(view.points)]
        if len(placed) < 2:
            return coarse
        poses = coarse.poses
        for _ in range(self.max_rounds):
            before, poses = poses, one_round(placed, poses, coarse.reference, pipeline)
            if farthest(placed, before, poses) <= STILL:
                break
        if not objective(poses, placed) < objective(coarse.poses, placed):
            return coarse
        return replace(coarse, poses=poses, model=None)


def one_round(
    views: Sequence[View], poses: Mapping[str, Array], reference: str, pipeline: Pipeline
) -> dict[str, Array]:
    """The poses after every view but the reference was refined once against all the others."""
    poses = dict(poses)
    for view in views:
        if view.name != reference:
            others = union(views, poses, view.name)
            found = pipeline.refine(view, others, poses[view.name])
            if np.isfinite(found.T_target_source).all():
                poses[view.name] = found.T_target_source
    return poses
