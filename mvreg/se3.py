"""Rigid motions as 4x4 matrices: apply, invert, fit, draw at random, measure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def apply(transform: Array, points: Array) -> Array:
    """Transform points.

    Parameters
    ----------
    transform : (4, 4) array
        ``T_target_source``.
    points : (..., 3) array
        In the source frame.

    Returns
    -------
    (..., 3) array
        In the target frame.
    """
    moved: Array = points @ transform[:3, :3].T + transform[:3, 3]
    return moved


def from_parts(rotation: Array, translation: Array) -> Array:
    """(..., 4, 4) transforms from rotations (..., 3, 3) and translations (..., 3)."""
    transform = np.zeros((*rotation.shape[:-2], 4, 4))
    transform[..., :3, :3] = rotation
    transform[..., :3, 3] = translation
    transform[..., 3, 3] = 1.0
    return transform


def invert(transform: Array) -> Array:
    """The inverse of rigid transforms (..., 4, 4), exact up to rounding."""
    rotation = np.swapaxes(transform[..., :3, :3], -1, -2)
    translation = -(rotation @ transform[..., :3, 3:])[..., 0]
    return from_parts(rotation, translation)


def fit(source: Array, target: Array, weights: Array | None = None) -> Array:
    """The rigid motions that map source points onto target points best (Kabsch).

    Parameters
    ----------
    source, target : (..., N, 3) arrays
        Corresponding points; leading axes are a batch.
    weights : (..., N) array, optional
        Non-negative weights of the pairs.

    Returns
    -------
    (..., 4, 4) array
        ``T_target_source``; always a proper rotation, also for flat or collinear points.
    """
    if weights is None:
        mean_source, mean_target = source.mean(axis=-2), target.mean(axis=-2)
        centred = target - mean_target[..., None, :]
    else:
        share = (weights / weights.sum(axis=-1, keepdims=True))[..., None]
        mean_source, mean_target = (share * source).sum(axis=-2), (share * target).sum(axis=-2)
        centred = share * (target - mean_target[..., None, :])
    covariance = np.swapaxes(source - mean_source[..., None, :], -1, -2) @ centred
    u, _, vt = np.linalg.svd(covariance)
    v = np.swapaxes(vt, -1, -2)
    sign = np.ones((*covariance.shape[:-2], 3))
    sign[..., 2] = np.sign(np.linalg.det(v @ np.swapaxes(u, -1, -2)))
    rotation = (v * sign[..., None, :]) @ np.swapaxes(u, -1, -2)
    translation = mean_target - (rotation @ mean_source[..., None])[..., 0]
    return from_parts(rotation, translation)


def project(transform: Array) -> Array:
    """The nearest rigid motion to a (4, 4) matrix: takes the drift out of long products."""
    u, _, vt = np.linalg.svd(transform[:3, :3])
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return from_parts(rotation, transform[:3, 3])


def rotation_angle(first: Array, second: Array) -> Array:
    """Angles in radians between the rotations of transforms (..., 4, 4)."""
    difference = first[..., :3, :3] - second[..., :3, :3]
    norm = np.linalg.norm(difference, axis=(-2, -1))
    angle: Array = 2 * np.arcsin(np.clip(norm / np.sqrt(8), 0, 1))
    return angle


def random(rng: np.random.Generator, shift: float = 0.0) -> Array:
    """A rigid motion: a uniform rotation, and a translation uniform within +-`shift`."""
    quaternion = rng.normal(size=4)
    return from_parts(
        rotation_from_quaternion(quaternion), rng.uniform(-shift, shift, size=3) if shift else
        np.zeros(3),
    )  # fmt: skip


def rotation_from_quaternion(quaternion: Array) -> Array:
    """(3, 3) rotation of a quaternion (x, y, z, w) of any non-zero length."""
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
