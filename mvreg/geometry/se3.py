"""Rigid motions as 4x4 matrices: apply, invert, fit, draw at random, measure."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array

__all__ = [
    "about",
    "apply",
    "exp",
    "fit",
    "from_parts",
    "invert",
    "log",
    "project",
    "quaternion",
    "random",
    "rotation_angle",
    "rotation_from_quaternion",
    "rotation_vector",
    "skew",
]


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
    """A rigid motion (4, 4): a uniform rotation, and a translation uniform within +-`shift`."""
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


def skew(vectors: Array) -> Array:
    """(..., 3, 3) matrices of the cross product: ``skew(a) @ b = a x b``."""
    matrix = np.zeros((*vectors.shape, 3))
    x, y, z = np.moveaxis(vectors, -1, 0)
    matrix[..., 2, 1], matrix[..., 0, 2], matrix[..., 1, 0] = x, y, z
    matrix[..., 1, 2], matrix[..., 2, 0], matrix[..., 0, 1] = -x, -y, -z
    return matrix


def rotation_vector(rotation: Array) -> Array:
    """Axis times angle (..., 3), at most pi long, of rotations (..., 3, 3).

    By way of the quaternion, which stays exact near no turn and near half a turn; of the four ways
    to read it off the matrix the one with the largest divisor (Shepperd 1978).
    """
    trace = np.trace(rotation, axis1=-2, axis2=-1)[..., None, None]
    outer = np.empty((*rotation.shape[:-2], 4, 4))  # 4 q q^T, q = (x, y, z, w)
    swapped = np.swapaxes(rotation, -1, -2)
    outer[..., :3, :3] = rotation + swapped + (1 - trace) * np.eye(3)
    turn = (rotation - swapped)[..., [2, 0, 1], [1, 2, 0]]
    outer[..., :3, 3] = outer[..., 3, :3] = turn
    outer[..., 3, 3] = 1 + trace[..., 0, 0]
    row = np.diagonal(outer, axis1=-2, axis2=-1).argmax(axis=-1)
    quaternion = np.take_along_axis(outer, row[..., None, None], axis=-2)[..., 0, :]
    quaternion = quaternion * np.where(quaternion[..., 3:] < 0, -1.0, 1.0)
    quaternion = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    sine = np.linalg.norm(quaternion[..., :3], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quaternion[..., 3:])
    vector: Array = quaternion[..., :3] * np.where(sine > 0, angle / np.where(sine > 0, sine, 1), 2)
    return vector


def quaternion(rotation: Array) -> Array:
    """The quaternion (x, y, z, w) of a rotation (3, 3), of length 1, with w >= 0.

    Exact near no turn and near half a turn, as `rotation_vector` is.
    """
    vector = rotation_vector(rotation)
    angle = float(np.linalg.norm(vector))
    # sin(a/2)/a has the limit 1/2; np.sinc(t) = sin(pi t) / (pi t).
    found = np.append(vector * np.sinc(angle / (2 * np.pi)) / 2, np.cos(angle / 2))
    unit: Array = found / np.linalg.norm(found)
    return unit


def _series(angle: Array) -> tuple[Array, Array, Array, Array]:
    """Coefficients of the closed forms of `exp` and `log`, by their series where angles are small.

    ``sin(a)/a, (1 - cos a)/a^2, (a - sin a)/a^3`` and ``(1 - a/2 cot a/2)/a^2``.
    """
    small = angle < 1e-2
    a, square = np.where(small, 1.0, angle), angle**2
    first = np.where(small, 1 - square / 6 + square**2 / 120, np.sin(a) / a)
    second = np.where(small, 0.5 - square / 24 + square**2 / 720, 2 * (np.sin(a / 2) / a) ** 2)
    third = np.where(small, 1 / 6 - square / 120, (a - np.sin(a)) / a**3)
    half = a / 2
    inverse = np.where(
        small, 1 / 12 + square / 720, (1 - half * np.cos(half) / np.sin(half)) / a**2
    )
    return first, second, third, inverse


def adjoint(transform: Array) -> Array:
    """The matrix (6, 6) with ``T exp(v) = exp(Ad v) T``, of twists with the rotation first."""
    rotation, shift = transform[:3, :3], transform[:3, 3]
    found = np.zeros((6, 6))
    found[:3, :3] = found[3:, 3:] = rotation
    found[3:, :3] = skew(shift) @ rotation
    return found


def exp(twist: Array) -> Array:
    """The rigid motions (..., 4, 4) of twists (..., 6): three of rotation, three of translation.

    Closed form, e.g. Murray, Li and Sastry 1994, Eqs. (2.14) and (2.36).
    """
    angle = np.linalg.norm(twist[..., :3], axis=-1)[..., None, None]
    first, second, third, _ = _series(angle)
    cross = skew(twist[..., :3])
    square = cross @ cross
    rotation = np.eye(3) + first * cross + second * square
    left = np.eye(3) + second * cross + third * square
    return from_parts(rotation, (left @ twist[..., 3:, None])[..., 0])


def log(transform: Array) -> Array:
    """The twists (..., 6) of rigid motions (..., 4, 4): ``exp(log(T)) = T``, angles up to pi."""
    vector = rotation_vector(transform[..., :3, :3])
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    cross = skew(vector)
    inverse = np.eye(3) - cross / 2 + _series(angle)[3] * (cross @ cross)
    shift = (inverse @ transform[..., :3, 3:])[..., 0]
    return np.concatenate([vector, shift], axis=-1)


def about(centre: Array, motion: Array) -> Array:
    """A motion (4, 4) found in coordinates about a centre (3,), in those about the origin."""
    rotation = motion[:3, :3]
    return from_parts(rotation, centre + motion[:3, 3] - rotation @ centre)
