"""Relief for the parts of a shape: bumps, ridges and folds of cloth, as heights over points."""

from __future__ import annotations

import numpy as np

from mvreg.datasets.sdf import Array, Distance
from mvreg.geometry import se3


def turned(z: float = 0, y: float = 0, x: float = 0) -> Array:
    """Rotation (3, 3) by angles in degrees about z, then the new y, then the new x."""
    matrix: Array = np.eye(3)
    for axis, degrees in ((2, z), (1, y), (0, x)):
        half = np.radians(degrees) / 2
        quaternion = np.append(np.sin(half) * np.eye(3)[axis], np.cos(half))
        matrix = matrix @ se3.rotation_from_quaternion(quaternion)
    return matrix


def bumps(wavelength: float, height: float, seed: int | np.integer) -> Distance:
    """Irregular relief of about the given wavelength and height: a sum of random waves."""
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(6, 3))
    waves *= 2 * np.pi / wavelength / np.linalg.norm(waves, axis=1, keepdims=True)
    waves *= rng.uniform(0.7, 1.4, size=(6, 1))
    phases = rng.uniform(0, 2 * np.pi, size=6)

    def relief(points: Array) -> Array:
        height_at: Array = height / 3 * np.sin(points @ waves.T + phases).sum(axis=1)
        return height_at

    return relief


def ridges(direction: tuple[float, float, float], wavelength: float, height: float,
           sway: float = 0.0) -> Distance:  # fmt: skip
    """Parallel ridges across `direction`, made to wander by `sway`."""
    along = np.array(direction) / np.linalg.norm(direction) * 2 * np.pi / wavelength
    wander = bumps(5 * wavelength, sway, 7)

    def relief(points: Array) -> Array:
        height_at: Array = height * np.sin(points @ along + wander(points))
        return height_at

    return relief


def folds(centre: tuple[float, float], count: float, height: float, bottom: float, top: float,
          seed: int) -> Distance:  # fmt: skip
    """Folds of cloth that hang around a vertical axis: deep at `bottom`, gone at `top`."""
    uneven = np.random.default_rng(seed).uniform(0, 2 * np.pi, size=3)

    def relief(points: Array) -> Array:
        angle = np.arctan2(points[:, 1] - centre[1], points[:, 0] - centre[0])
        wave = np.sin(count * angle + 1.3 * np.sin(2 * angle + uneven[0]) + uneven[1])
        wave += 0.5 * np.sin(np.round(count * 0.6) * angle + uneven[2] + points[:, 2] / 9)
        share = np.clip((top - points[:, 2]) / (top - bottom), 0, 1)
        height_at: Array = height * share * wave
        return height_at

    return relief
