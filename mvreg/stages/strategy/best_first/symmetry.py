"""Symmetry hypotheses: poses in which the source, turned or slid, fits about as well.

A box fits itself turned by half a turn, a prism by less; a corridor or a row of windows fits itself
slid along. A search that finds one of these poses may not have come across the others; so they are
made, and refined, before the pose is relied on.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TypeAlias

import numpy as np

from mvreg.contracts import Refine
from mvreg.geometry import se3
from mvreg.parallel import in_threads
from mvreg.screening import COARSE_STEP, FINE_STEP, MAX_OBJECTIVE_RATIO, thinned
from mvreg.stages.strategy.best_first.hypotheses import distinct
from mvreg.types import Array, Registration, View

#: Turns (degrees) about each axis: what is symmetric about an axis, two, three, four, five, six,
#: eight, nine or ten times over, is so under one of these.
TURNS = (72.0, 120.0, 180.0)
#: Rotated poses with an objective this many times that of the pose itself are no alternatives,
#: where exact scans count as if they fitted to a third of a resolution. The right pose of a box,
#: with less overlap than a wrong one, had four times as much.
AS_GOOD, FINEST = 10.0, 0.3
#: Axes are settled if each has so many times as many normals as the one before. If not, some of the
#: normals, so many, vote for those whose cosine with their own is larger.
ALIKE, VOTERS, ALONG = 1.3, 300, 0.985
#: The middle is that of the points but for this share at either end, which may be stray.
STRAY = 0.02
#: A view slides along an axis if its normals' mean squared share along it is less (a sphere has a
#: third), in steps of so many spacings of the keypoints, in so many steps at most each way.
WEAK, SLIDE, MOST_SLIDES = 0.2, 1.5, 12

#: Points, normals and axes of two views, see `_seen`.
Seen: TypeAlias = tuple[Array, Array, Array]


def symmetry_hypotheses(
    registration: Registration, source: View, target: View, refine: Refine
) -> Array:
    """Poses in which the source, turned or slid on what is seen, fits about as well.

    The axes are those of the normals' scatter: of a box they are its edges. They meet in the middle
    of the extent of both views along them, which of a box seen from enough sides is its middle.
    Slides are along the axis that fewest normals point along.

    Parameters
    ----------
    registration : Registration
    source, target : View
    refine : Refine
        Refines these poses, on few points.

    Returns
    -------
    (R, 4, 4) array
        ``T_target_source``, best first; empty for most objects.
    """
    if not len(source.points) or not len(target.points):
        return np.empty((0, 4, 4))
    pose = registration.T_target_source
    seen = _seen(source, target, pose)
    starts = [motion @ pose for motion in (*_turns(seen), *_slides(seen, source.scale.spacing))]
    _ = target.tree  # built once, before the threads ask for it
    near, own = _refined(refine, thinned(source, COARSE_STEP), target, pose, starts)
    good = _as_good(near, own, source, MAX_OBJECTIVE_RATIO)  # most turns fit nowhere near as well
    found = np.array([pose, *(one.T_target_source for one in good)])
    starts = list(found[distinct(source, found)[1:]])  # most slides come back to the pose
    if not starts:
        return np.empty((0, 4, 4))
    near, own = _refined(refine, thinned(source, FINE_STEP), target, pose, starts)
    good = _as_good(near, own, source, 1.0)
    return np.array([one.T_target_source for one in good]).reshape(-1, 4, 4)


def _refined(
    refine: Refine, source: View, target: View, pose: Array, starts: Sequence[Array]
) -> tuple[list[Registration], Registration]:
    """Where a refinement leads to from each of the starts, and from the pose itself."""
    own, *others = in_threads(partial(refine, source, target), [pose, *starts])
    return others, own


def _as_good(
    found: Sequence[Registration], own: Registration, source: View, slack: float
) -> list[Registration]:
    """Those that fit about as well as the pose itself, best first."""
    most = slack * AS_GOOD * max(own.objective, (FINEST * source.scale.resolution) ** 2)
    good = (one for one in found if one.objective <= most)
    return sorted(good, key=lambda one: one.objective)


def _turns(seen: Seen) -> list[Array]:
    """Motions (4, 4) in the target's frame: every turn about every axis."""
    points, _, axes = seen
    found = []
    for frame in np.split(axes, len(axes) // 3):
        low, high = np.quantile(points @ frame.T, [STRAY, 1 - STRAY], axis=0)
        middle = (low + high) / 2 @ frame
        for axis in frame:
            for degrees in TURNS:
                turn = se3.exp(np.concatenate([np.deg2rad(degrees) * axis, np.zeros(3)]))[:3, :3]
                found.append(se3.from_parts(turn, middle - turn @ middle))
    return found


def _slides(seen: Seen, spacing: float) -> list[Array]:
    """Motions (4, 4) in the target's frame along the axis that normals hold least, if they do not.

    So far apart that a refinement finds what is between two of them, and up to half of the extent.
    """
    points, normals, axes = seen
    weakest = axes[0]
    if ((normals @ weakest) ** 2).mean() > WEAK:
        return []
    extent = float(np.ptp(points @ weakest)) / 2
    step = max(SLIDE * spacing, extent / MOST_SLIDES)
    found = []
    for shift in np.arange(step, extent, step):
        for sign in (-1.0, 1.0):
            found.append(se3.from_parts(np.eye(3), sign * shift * weakest))
    return found


def _seen(source: View, target: View, pose: Array) -> Seen:
    """Points and normals of both views in the target's frame, and the axes of their normals.

    Of the axes, see `_axes`, the first is that along which fewest normals point.
    """
    points = np.concatenate([se3.apply(pose, source.points), target.points])
    normals = np.concatenate([source.normals @ pose[:3, :3].T, target.normals])
    return points, normals, _axes(normals)


def _axes(normals: Array) -> Array:
    """Axes (3 or 6, 3), in rows, of the scatter of normals (N, 3): that of the fewest first.

    Where two of them have about as many normals, as the ground and the walls of a yard, they may be
    any; the three directions at right angles that most normals point along come besides.
    """
    values, vectors = np.linalg.eigh(normals.T @ normals)
    if (values[1:] > ALIKE * values[:-1]).all():
        return vectors.T
    few = normals[:: max(1, len(normals) // VOTERS)]
    near = np.abs(few @ few.T) > ALONG
    first = _mean(few[near[near.sum(axis=1).argmax()]])
    across = few[np.abs(few @ first) < np.sqrt(1 - ALONG**2)]
    if not len(across):
        return vectors.T
    near = np.abs(across @ across.T) > ALONG
    second = _mean(across[near[near.sum(axis=1).argmax()]])
    second -= (second @ first) * first
    second /= np.linalg.norm(second)
    return np.concatenate([vectors.T, [first, second, np.cross(first, second)]])


def _mean(normals: Array) -> Array:
    """The mean direction (3,) of normals (N, 3) of any sign."""
    direction: Array = np.linalg.eigh(normals.T @ normals)[1][:, -1]
    return direction
