"""How far poses move the points of a view, and whether points determine a pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array
from mvreg.types import View

#: The poses stand still when no point moves farther in one round than this (resolutions).
STILL = 0.05
#: Points on a line, up to this share of their length, do not fix a pose.
FLAT = 1e-6


def farthest(
    views: Sequence[View], before: Mapping[str, Array], after: Mapping[str, Array]
) -> float:
    """How far any point of the views is from where it was, in resolutions."""
    moves = [0.0]
    for view in views:
        if len(view.points) and view.scale.resolution > 0:
            was = se3.apply(before[view.name], view.points)
            gap = se3.apply(after[view.name], view.points) - was
            moves.append(float(np.linalg.norm(gap, axis=1).max()) / view.scale.resolution)
    return max(moves)


def rms_apart(points: Array, first: Array, second: Array) -> float:
    """How far apart two poses (4, 4) put points (N, 3): root mean square, a length; 0 for none."""
    gaps = se3.apply(first, points) - se3.apply(second, points)
    return float(np.sqrt((gaps**2).sum(axis=1).mean())) if len(gaps) else 0.0


def fixes_pose(points: Array) -> bool:
    """Whether points (N, 3) have a pose: not fewer than three, and not all on a line."""
    if len(points) < 3:
        return False
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > FLAT * spread[0])
