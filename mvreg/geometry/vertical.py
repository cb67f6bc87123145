"""Poses between frames whose verticals are known: how far they tilt, and how they are levelled."""

from __future__ import annotations

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.arrays import Array


def tilt(poses: Array, up_source: Array, up_target: Array) -> Array:
    """Angles (...,), in degrees, between the source's vertical, moved, and the target's.

    Parameters
    ----------
    poses : (..., 4, 4) array
        ``T_target_source``.
    up_source, up_target : (3,) arrays
        Unit vectors, each in its own frame.
    """
    return np.degrees(_axis_and_angle(poses, up_source, up_target)[1])


def levelled(
    poses: Array, up_source: Array, up_target: Array, centre: Array, most: float = 0.0
) -> Array:
    """The poses that tilt by `most` (degrees) at most, and are else the nearest to those given.

    What is too much is turned back about a horizontal axis through the `centre`, which stays where
    it is: nothing is changed of the turn about the vertical. Poses that tilt less stay as they are.

    Parameters
    ----------
    poses : (..., 4, 4) array
        ``T_target_source``.
    up_source, up_target : (3,) arrays
        Unit vectors, each in its own frame.
    centre : (3,) array
        In the source's frame, as the middle of its points.
    most : float
        0 leaves turns about the vertical and translations alone.
    """
    axis, angle = _axis_and_angle(poses, up_source, up_target)
    turn = np.maximum(angle - np.radians(most), 0.0)
    twist = np.concatenate([turn[..., None] * axis, np.zeros_like(axis)], axis=-1)
    rotation = se3.exp(twist)[..., :3, :3] @ poses[..., :3, :3]
    place = poses[..., :3, :3] @ centre + poses[..., :3, 3]
    found = se3.from_parts(rotation, place - rotation @ centre)
    return np.where((turn > 0)[..., None, None], found, poses)


def _axis_and_angle(poses: Array, up_source: Array, up_target: Array) -> tuple[Array, Array]:
    """The turns that take the verticals moved to the target's: unit axes (..., 3), radians."""
    moved = poses[..., :3, :3] @ up_source
    across = np.cross(moved, up_target)
    sine = np.linalg.norm(across, axis=-1)
    aside = np.cross(up_target, np.eye(3)[np.abs(up_target).argmin()])  # any, if upside down
    axis = np.where(
        (sine > 1e-12)[..., None], across / np.maximum(sine, 1e-12)[..., None],
        aside / np.linalg.norm(aside),
    )  # fmt: skip
    return axis, np.arctan2(sine, moved @ up_target)
