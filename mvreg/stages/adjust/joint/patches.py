"""Axes of the patches of a surface: along the surface and out of it, or along the sensor's rays."""

from __future__ import annotations

import numpy as np

from mvreg.types import Array

#: Rays at a lower angle than this to the surface (tangent of their incidence) are taken to be at
#: this one: a patch asked along them would be asked far outside of its points.
STEEPEST = 4.0


def axes_about(normals: Array) -> Array:
    """Right-handed axes (S, 3, 3), in rows, of which the third is the normal (S, 3)."""
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=1)


def along_rays(axes: Array, towards: Array) -> Array:
    """Axes whose first two coordinates are the same all along a ray.

    A range is wrong along its ray. Where the ray meets the surface at an angle, that also moves the
    point along the surface, and heights over where it was measured are biased wherever the surface
    bends (errors in variables; by 1.5 times the bend times the noise along the surface squared).
    Over where its ray crosses the plane of the patch they are not.

    Parameters
    ----------
    axes : (S, 3, 3) array
        In rows, orthonormal, the third out of the surface.
    towards : (S, 3) array
        Unit vectors towards the sensor.

    Returns
    -------
    (S, 3, 3) array
        The same third rows; the others are not orthogonal to them, nor unit.
    """
    first, second, out = np.einsum("sab,sb->as", axes, towards)
    aside = np.stack([first, second], axis=1) / np.maximum(np.abs(out), 1e-3)[:, None]
    aside *= np.sign(out)[:, None]
    steep = np.linalg.norm(aside, axis=1)
    aside *= (STEEPEST / np.maximum(steep, STEEPEST))[:, None]
    found = axes.copy()
    found[:, :2] -= aside[:, :, None] * axes[:, 2:]
    return found
