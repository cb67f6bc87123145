"""Where to put a camera."""

from __future__ import annotations

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.types import Array


def look_at(eye: Array, target: Array, roll: float = 0.0) -> Array:
    """The pose ``T_world_scan`` (4, 4) of a camera at `eye` that looks at `target`.

    The picture's y axis is as near to the world's z as it can be, then turned by `roll` (degrees)
    about the line of sight.

    Raises
    ------
    InputError
        If both points are the same.
    """
    back = np.asarray(eye, dtype=float) - target
    if not np.linalg.norm(back) > 0:
        raise InputError("look_at: expected two different points, eye and target are the same")
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    if np.linalg.norm(right) < 1e-9:
        right = np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    c, s = np.cos(np.radians(roll)), np.sin(np.radians(roll))
    rotation = np.column_stack([c * right + s * up, c * up - s * right, back])
    return se3.from_parts(rotation, np.asarray(eye, dtype=float))


def orbit(
    target: Array, distance: float, azimuth: float, elevation: float, roll: float = 0.0
) -> Array:
    """`look_at` from a sphere around `target`: azimuth 0 is at -y, 90 at +x; angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    direction = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
    return look_at(target + distance * direction, target, roll)
