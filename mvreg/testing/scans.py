"""Small synthetic scans with exact poses, for tests: no files, no Open3D, a tenth of a second each.

A lumpy blob, given by a formula, is looked at by an orthographic range camera. Lengths are in mm,
but nothing depends on it. Every scan has a frame of its own and knows its view direction.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.sphere import sphere_directions as sphere_directions
from mvreg.testing.compare import locked
from mvreg.types import Array, Scan, ScanSet

#: Mean radius of the blob (mm).
RADIUS = 50.0
#: Steps in which a ray looks for the surface, and halvings of the step in which it is found.
MARCHES, HALVINGS = 40, 20


def blob_radius(directions: Array, number: int = 1, relief: float = 0.2) -> Array:
    """Radius (...,) of blob `number` towards unit `directions` (..., 3), in mm.

    `relief` scales its lumps, which are larger the wider they are; 0 is a sphere.
    """
    rng = np.random.default_rng(number)
    waves = rng.normal(size=(10, 3))
    frequencies = np.linspace(2, 9, 10)
    waves *= frequencies[:, None] / np.linalg.norm(waves, axis=1, keepdims=True)
    lumps = np.sin(directions @ waves.T + rng.uniform(0, 2 * np.pi, size=10))
    radius: Array = RADIUS * (1 + relief * lumps @ (3 / frequencies))
    return radius


def sensor_pose(azimuth: float, elevation: float = 0.0, roll: float = 0.0) -> Array:
    """``T_world_scan`` (4, 4) of a sensor that looks at the origin; its +z points back at it.

    Angles in degrees.
    """
    a, e, r = np.deg2rad([azimuth, elevation, roll])
    z = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    x = np.array([-np.sin(a), np.cos(a), 0.0])
    y = np.cross(z, x)
    turned = np.stack([np.cos(r) * x + np.sin(r) * y, np.cos(r) * y - np.sin(r) * x, z], axis=1)
    return se3.from_parts(turned, np.zeros(3))


def blob_scan(
    pose: Array,
    points: int = 2500,
    *,
    name: str = "scan",
    number: int = 1,
    relief: float = 0.2,
) -> Scan:
    """Scan a blob from the sensor's `pose`, without noise.

    Parameters
    ----------
    pose : (4, 4) array
        ``T_world_scan``; the sensor looks along its -z.
    points : int
        How many points, about.
    name : str
        The scan's.
    number, relief
        Which blob, and how lumpy; see `blob_radius`.
    """
    radii = blob_radius(sphere_directions(1000), number, relief)
    size, step = 1.05 * radii.max(), np.sqrt(np.pi * (radii**2).mean() / points)
    axis = np.arange(-size, size, step)
    x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))

    def inside(x: Array, y: Array, z: Array) -> Array:
        rays = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
        length = np.linalg.norm(rays, axis=-1)
        directions = rays @ pose[:3, :3].T / np.maximum(length, 1e-9)[..., None]
        within: Array = length < blob_radius(directions, number, relief)
        return within

    heights, gap = np.linspace(size, -size, MARCHES, retstep=True)
    within = inside(x, y, heights[:, None])
    hit = within.any(axis=0)
    x, y, z = x[hit], y[hit], heights[within.argmax(axis=0)[hit]]
    for halving in range(1, HALVINGS):
        outer = z - gap / 2**halving  # the gap is negative: rays come from above
        z = np.where(inside(x, y, outer), outer, z)
    return Scan(name, np.stack([x, y, z], axis=1), np.array([0.0, 0.0, 1.0]))


@cache
def blob_scans(
    count: int = 4,
    step: float = 40.0,
    points: int = 2500,
    *,
    number: int = 1,
    relief: float = 0.2,
    noise: float = 0.02,
) -> ScanSet:
    """Scans all around a blob, `step` degrees apart, each in a frame drawn at random.

    Neighbours share about four fifths of their points. `noise` is the standard deviation of the
    range (mm).

    Returns
    -------
    ScanSet
        With exact poses ``T_world_scan``; the same at every call, and read-only.
    """
    rng = np.random.default_rng(7 + number)
    scans, poses = [], {}
    for index in range(count):
        pose = sensor_pose(index * step, rng.uniform(-15, 15), rng.uniform(0, 360))
        scan = blob_scan(pose, points, name=f"blob_{index}", number=number, relief=relief)
        range_error = noise * rng.normal(size=(len(scan.points), 1)) * [0, 0, 1]
        motion = se3.random(rng, RADIUS)
        scans.append(replace(scan, points=scan.points + range_error).moved(motion))
        poses[scan.name] = pose @ se3.invert(motion)
    made: ScanSet = locked(ScanSet("blob", tuple(scans), "mm", poses))
    return made


def plane_scans(count: int = 2, side: int = 30) -> ScanSet:
    """Scans of one and the same plane, of `side` times `side` points: nothing fixes their poses."""
    rng = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), [0]), axis=-1).reshape(-1, 3)
    scans, poses = [], {}
    for index in range(count):
        motion = se3.random(rng, RADIUS)
        scan = Scan(f"plane_{index}", 2.0 * grid, np.array([0.0, 0.0, 1.0]))
        scans.append(scan.moved(motion))
        poses[scan.name] = se3.invert(motion)
    return ScanSet("plane", tuple(scans), "mm", poses)


def degenerate_points() -> dict[str, Array]:
    """Points (N, 3) that cannot be registered, by what is wrong with them."""
    rng = np.random.default_rng(5)
    line = rng.uniform(-RADIUS, RADIUS, size=(60, 1))
    flat = rng.uniform(-RADIUS, RADIUS, size=(200, 2))
    return {
        "one point": np.array([[3.0, -2.0, 7.0]]),
        "two points": np.array([[3.0, -2.0, 7.0], [4.0, -2.0, 5.0]]),
        "three points": rng.normal(scale=RADIUS, size=(3, 3)),
        "duplicates": np.tile([[1.0, 2.0, 3.0]], (40, 1)),
        "collinear": line * np.array([1.0, 2.0, -0.5]) + 5.0,
        "planar": np.concatenate([flat, np.zeros((200, 1))], axis=1),
    }
