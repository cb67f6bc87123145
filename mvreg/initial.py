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
    covariances = dict(result.covariances)
    models = []
    for poses in (result.poses, *result.components):
        held = next((name for name in poses if name in fixed), None)
        if held is None:
            models.append(poses)
            continue
        motion = fixed[held] @ se3.invert(poses[held])
        models.append({name: fixed.get(name, motion @ pose) for name, pose in poses.items()})
        turn = adjoint(motion)
        covariances |= {
            name: turn @ covariances[name] @ turn.T for name in poses if name in covariances
        }
    return replace(
        result, poses=models[0], components=tuple(models[1:]), covariances=covariances, model=None
    )


def adjoint(transform: Array) -> Array:
    """The matrix (6, 6) with ``T exp(v) = exp(Ad v) T``, of twists with the rotation first."""
    rotation, shift = transform[:3, :3], transform[:3, 3]
    found = np.zeros((6, 6))
    found[:3, :3] = found[3:, 3:] = rotation
    found[3:, :3] = se3.skew(shift) @ rotation
    return found
