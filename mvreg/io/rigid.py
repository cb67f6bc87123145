"""Rotations as people and programs print them: with few digits."""

from __future__ import annotations

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array

#: Largest entry of R^T R - I that a long product of rotations in a text file explains.
DRIFT = 1e-2
#: Of a million random rotations with entries of two decimals the nearest rotation differs by up to
#: 0.0084 in an entry, and the cube root of the determinant by up to 0.0064 from 1.
ROUNDED, SCALE = 0.009, 0.0065
#: A rotation so near in all entries, as one of four decimals is, needs no mention.
FINE = 1e-4


def nearest_rigid(pose: Array) -> tuple[Array, float]:
    """The nearest rigid motion to a finite matrix (4, 4) that is one but for few digits.

    Returns
    -------
    pose : (4, 4) array
    deviation : float
        The largest difference between entries of the two rotations.

    Raises
    ------
    ValueError
        For a matrix that rounding to two decimals does not explain: says in words what it does.
    """
    rotation = np.clip(pose[:3, :3], -9, 9)  # so that nonsense cannot overflow
    found = se3.project(pose)
    deviation = float(np.abs(pose[:3, :3] - found[:3, :3]).max())
    determinant = float(np.linalg.det(rotation))
    error = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    rounded = deviation <= ROUNDED and abs(np.cbrt(determinant) - 1) <= SCALE
    if determinant > 0 and (error <= DRIFT or rounded):
        return found, deviation
    raise ValueError(
        "expected a rotation, got a matrix that scales, shears or mirrors "
        f"(R^T R - I up to {error:.2g}, determinant {determinant:.3g})"
    )
