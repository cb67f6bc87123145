"""Rotations as quaternions."""

from __future__ import annotations

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array


def quaternion(rotation: Array) -> Array:
    """The quaternion (x, y, z, w) of a rotation (3, 3), of length 1, with w >= 0.

    Exact near no turn and near half a turn, as `se3.rotation_vector` is.
    """
    vector = se3.rotation_vector(rotation)
    angle = float(np.linalg.norm(vector))
    # sin(a/2)/a has the limit 1/2; np.sinc(t) = sin(pi t) / (pi t).
    found = np.append(vector * np.sinc(angle / (2 * np.pi)) / 2, np.cos(angle / 2))
    unit: Array = found / np.linalg.norm(found)
    return unit
