"""Directions evenly spread over a sphere."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array


def spiral(heights: Array) -> Array:
    """Unit vectors (N, 3) at heights (N,) along z, each a golden angle on from the one before."""
    index = np.arange(len(heights)) + 0.5
    angle, flat = np.pi * (1 + np.sqrt(5)) * index, np.sqrt(1 - heights**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), heights], axis=1)


def sphere_directions(count: int) -> Array:
    """Unit vectors (count, 3), evenly spread over the sphere, from +z to -z."""
    return spiral(1 - 2 * (np.arange(count) + 0.5) / count)


def half_sphere_directions(count: int) -> Array:
    """Unit vectors (count, 3), evenly spread over the half of the sphere about +z."""
    return spiral(1 - (np.arange(count) + 0.5) / count)
