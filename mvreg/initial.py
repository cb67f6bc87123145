"""Poses known beforehand: as candidates beside those found, and for scans that keep theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array, Candidates, Model, Result, Scan, View


def with_initial(candidates: Candidates, source: View, target: View) -> Candidates:
    """The candidates of a pair, and before them the relative pose that is known beforehand.

    Of a model the first part counts that has an initial pose.
    """
    pose = initial_pose(source, target)
    if pose is None:
        return candidates
    best = float(candidates.scores.min(initial=0.0))
    none = np.empty((0, 2), dtype=np.intp)
    return Candidates(
        np.concatenate([pose[None], candidates.poses]),
        np.concatenate([[best], candidates.scores]),
        (none, *candidates.matches),
    )


def initial_pose(source: View, target: View) -> Array | None:
    """``T_target_source`` (4, 4) as known beforehand; None where it is not."""
    if source.scan is None or source.scan.initial is None:
        return None
    parts = (
        [(part.view, part.T_model_scan) for part in target.parts]
        if isinstance(target, Model)
        else [(target, np.eye(4))]
    )
    for view, T_target_part in parts:
        if view.scan is not None and view.scan.initial is not None:
            pose: Array = T_target_part @ se3.invert(view.scan.initial) @ source.scan.initial
            return se3.project(pose)
    return None


def in_their_frame(result: Result, scans: Sequence[Scan]) -> Result:
    """The result with the partial models of fixed scans in the frame that these are fixed in."""
    fixed = {scan.name: scan.initial for scan in scans if scan.fixed and scan.initial is not None}
    if not fixed:
        return result
    covariances, scatter = dict(result.covariances), list(result.scatter)
    models = []
    for poses in (result.poses, *result.components):
        held = next((name for name in poses if name in fixed), None)
        if held is None:
            models.append(poses)
            continue
        motion = fixed[held] @ se3.invert(poses[held])
        models.append({name: fixed.get(name, motion @ pose) for name, pose in poses.items()})
        turn = se3.adjoint(motion)
        covariances |= {
            name: turn @ covariances[name] @ turn.T for name in poses if name in covariances
        }
        scatter = [
            replace(one, twists=turn @ one.twists) if held in one.fixed else one for one in scatter
        ]
    return replace(
        result, poses=models[0], components=tuple(models[1:]), covariances=covariances,
        scatter=tuple(scatter), model=None,
    )  # fmt: skip
