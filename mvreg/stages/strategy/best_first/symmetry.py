"""Symmetry hypotheses: poses in which the source, rotated about an axis, fits about as well.

A box fits itself turned by half a turn, a prism by less. A search that finds one of these poses may
not have come across the others; so they are made, and refined, before the pose is relied on.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from mvreg.contracts import Refine
from mvreg.geometry import se3
from mvreg.parallel import in_threads
from mvreg.screening import COARSE_STEP, FINE_STEP, MAX_OBJECTIVE_RATIO, thinned
from mvreg.types import Array, Registration, View

#: Turns (degrees) about each axis: what is symmetric about an axis, two, three, four, five, six,
#: eight, nine or ten times over, is so under one of these.
TURNS = (72.0, 120.0, 180.0)
#: Rotated poses with an objective this many times that of the pose itself are no alternatives,
#: where exact scans count as if they fitted to a third of a resolution. The right pose of a box,
#: with less overlap than a wrong one, had four times as much.
AS_GOOD, FINEST = 10.0, 0.3


def symmetry_hypotheses(
    registration: Registration, source: View, target: View, refine: Refine
) -> Array:
    """Poses in which the source, turned about the axes of what is seen, fits about as well.

    The axes are those of the normals' scatter: of a box they are its edges. They meet in the middle
    of the extent of both views along them, which of a box seen from enough sides is its middle.

    Parameters
    ----------
    registration : Registration
    source, target : View
    refine : Refine
        Refines the turned poses, on few points.

    Returns
    -------
    (R, 4, 4) array
        ``T_target_source``, best first; empty for most objects.
    """
    if not len(source.points) or not len(target.points):
        return np.empty((0, 4, 4))
    pose = registration.T_target_source
    starts = [turn @ pose for turn in _turns(source, target, pose)]
    _ = target.tree  # built once, before the threads ask for it
    for step, slack in (
        (COARSE_STEP, MAX_OBJECTIVE_RATIO),
        (FINE_STEP, 1.0),
    ):  # most turns fit nowhere near as well
        subsampled = thinned(source, step)
        own, *others = in_threads(partial(refine, subsampled, target), [pose, *starts])
        most = slack * AS_GOOD * max(own.objective, (FINEST * source.scale.resolution) ** 2)
        starts = [start for start, one in zip(starts, others, strict=True) if one.objective <= most]
        if not starts:
            return np.empty((0, 4, 4))
    good = sorted((one for one in others if one.objective <= most), key=lambda one: one.objective)
    return np.array([one.T_target_source for one in good])


def _turns(source: View, target: View, pose: Array) -> list[Array]:
    """Motions (4, 4) in the target's frame: every turn about every axis."""
    points = np.concatenate([se3.apply(pose, source.points), target.points])
    normals = np.concatenate([source.normals @ pose[:3, :3].T, target.normals])
    axes = np.linalg.eigh(normals.T @ normals)[1].T
    along = points @ axes.T
    middle = (along.min(axis=0) + along.max(axis=0)) / 2 @ axes
    found = []
    for axis in axes:
        for degrees in TURNS:
            turn = se3.exp(np.concatenate([np.deg2rad(degrees) * axis, np.zeros(3)]))[:3, :3]
            found.append(se3.from_parts(turn, middle - turn @ middle))
    return found
