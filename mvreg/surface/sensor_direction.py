"""Estimate the direction of a scan's sensor from its points alone.

Two cues. A range image samples the space across its rays evenly, so that its points are the denser
the more the surface faces the sensor: density over ``|n . d|`` is constant for the direction d of
the rays. And no point hides another from the sensor. The side is told by the shape: what one
sensor sees bulges towards it, and what is near to the sensor faces it more than what is far.

The direction is off by 0 to 5 degrees on the figurine's scans and by 1 to 9 on the Bunny's. The
Dragon and the Buddha were seen through the scanner's right mirror: +z, which is said to be their
sensor's side, and what their sampling says are 24 to 31 degrees apart. Directions between the two
hide the fewest points, and the answer is there, 18 to 30 degrees from +z.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mvreg.geometry.arrays import Flags
from mvreg.geometry.median import median
from mvreg.geometry.nearest import build_tree, neighbours_of
from mvreg.geometry.sphere import half_sphere_directions
from mvreg.kernels.hidden import hidden
from mvreg.types import Array, View
from mvreg.types.lazy import kept_on_argument

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree

#: Directions tried, over half a sphere: about 5 degrees apart.
DIRECTIONS = 600
#: Points asked for their density, and neighbours that tell it.
DENSITY_POINTS, NEIGHBOURS = 2000, 24
#: Points asked for a first direction, which least squares over all then move.
ROUGH_POINTS = 500
#: A point is at a border if its neighbours' mean is farther than this share of their reach.
INNER = 0.25
#: Points that may hide each other, and the cells of the picture they do it in (resolutions).
HIDING_POINTS, CELL = 4000, 2.0
#: One point hides another of the same cell that is so much farther (cells): what rises more steeply
#: than 80 degrees a sensor hardly sees.
DEPTH = 5.0
#: Directions that hide a share more than the best one lose their weight (scale of the decay).
HIDDEN_SCALE = 0.01
#: How far the two cues may differ: directions farther from where density points lose weight
#: (degrees), and there are none beyond `FAN`.
DENSITY_SCALE, FAN = 15.0, 50.0
#: What several sensors saw hides a share of itself whatever the direction: the Bunny's first three
#: scans together 0.10, five 0.23; single scans of all the sets 0.03 at most.
MOST_HIDDEN = 0.08
#: How the facing of near and far points counts against the bulge: neither alone is right on all
#: forty Stanford scans and the figurine's twelve.
FACING_WEIGHT = 0.2
#: How much a bulge makes up for misfit of the density.
BULGE_WEIGHT = 0.3


@kept_on_argument
def estimated_direction(view: View) -> Array | None:
    """A unit vector (3,) that points from the surface towards the sensor, or nearly.

    As if the sensor were far away; `mvreg.surface.sensor.estimated_sensor` asks whether it was.
    Kept on the view.

    Returns
    -------
    (3,) array or None
        None for what no single sensor saw, such as a closed surface, and for too few points.
    """
    axis = estimated_axis(view)
    return None if axis is None else axis * side(view.points, view.normals, axis)


def estimated_axis(view: View) -> Array | None:
    """The direction (3,) to the sensor or away from it; None as for `estimated_direction`."""
    points = view.points
    if len(points) < NEIGHBOURS or not view.resolution > 0:
        return None
    offsets = points - points.mean(axis=0)
    landmark = offsets[(offsets**2).sum(axis=1).argmax()]
    axis = dense_direction(view, landmark)
    fan = half_sphere(DIRECTIONS, axis, landmark)
    fan = fan[fan @ axis > np.cos(np.deg2rad(FAN))]
    step = -(-len(points) // HIDING_POINTS)
    few = offsets[::step]
    cell = CELL * view.resolution * np.sqrt(step)
    shares = hidden(few, fan, landmark, cell, DEPTH * cell)
    if shares.min() > MOST_HIDDEN:
        return None
    angles = np.rad2deg(np.arccos(np.clip(fan @ axis, -1, 1)))
    weights = np.exp(-(shares - shares.min()) / HIDDEN_SCALE - (angles / DENSITY_SCALE) ** 2)
    mean = weights @ fan
    direction: Array = mean / np.linalg.norm(mean)
    return direction


def half_sphere(count: int, pole: Array, landmark: Array) -> Array:
    """Unit vectors (count, 3), evenly spread, to the side of `pole` (3,).

    `landmark` (3,), a vector that turns with the scan, says how they lie around it, so that another
    frame of the scan only turns them.
    """
    x, y = across(pole, landmark).T
    found: Array = half_sphere_directions(count) @ np.stack([x, y, pole])
    return found


def across(direction: Array, landmark: Array) -> Array:
    """Unit vectors (3, 2) at right angles to a direction, and the first to a landmark, too."""
    x = np.cross(direction, landmark)
    if not np.linalg.norm(x) > 1e-6 * np.linalg.norm(landmark):
        x = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(direction, x)], axis=1)


def dense_direction(view: View, landmark: Array) -> Array:
    """The axis (3,) whose ``|n . d|`` the density of the points follows best; of any sign."""
    step = -(-len(view.points) // DENSITY_POINTS)
    points, normals = view.points[::step], view.normals[::step]
    cloud = view.points if view.scan is None else view.scan.points
    tree = build_tree(cloud) if view.scan is None else view.scan.tree
    count = min(NEIGHBOURS, len(cloud) - 1)
    reach, inner = reach_of_neighbours(cloud, tree, points, count, 1e-12 * view.resolution)
    if inner.sum() < NEIGHBOURS:
        inner[:] = True
    density, normals = reach[inner] ** -2.0, normals[inner]
    density = density / np.median(density)
    offsets = (points - points.mean(axis=0))[inner]
    few = slice(None, None, -(-len(density) // ROUGH_POINTS))
    axis = _most_facing(density[few], normals[few], offsets[few], landmark)
    for _ in range(10):  # least squares with the weights of Geman and McClure
        signed = np.where((normals @ axis)[:, None] < 0, -normals, normals)
        facing = np.maximum(signed @ axis, 0.05)
        residuals = density - np.median(density / facing) * facing
        spread = 3 * np.median(np.abs(residuals)) + 1e-12
        weights = 1 / (1 + (residuals / spread) ** 2)
        solution = np.linalg.lstsq(signed * weights[:, None], density * weights, rcond=None)[0]
        length = np.linalg.norm(solution)
        if not length > 1e-9:
            break
        axis = solution / length
    return axis


def reach_of_neighbours(
    cloud: Array, tree: Tree, points: Array, count: int, least: float = 0.0
) -> tuple[Array, Flags]:
    """How far the `count` nearest others of points (P, 3) reach in a cloud (N, 3), its tree given.

    Returns
    -------
    reach : (P,) array
        `least` or more (length).
    inner : (P,) array of bool
        Which points are not at a border, where half the neighbours are missing.
    """
    distances, indices = neighbours_of(tree, points, count + 1)
    reach = np.maximum(distances[:, -1], least)
    shift = np.linalg.norm(cloud[indices].mean(axis=1) - points, axis=1)
    inner: Flags = shift < INNER * reach
    return reach, inner


def _most_facing(density: Array, normals: Array, offsets: Array, landmark: Array) -> Array:
    """The best of a few directions, by the misfit of the density and by how the surface bulges.

    Of few flat faces the density alone leaves it open from which side each was seen.
    """
    start = np.linalg.eigh(normals.T @ normals)[1][:, -1]
    start = start if start @ landmark >= 0 else -start
    directions = half_sphere(DIRECTIONS, start, landmark)
    cosines = directions @ normals.T
    facing = np.maximum(np.abs(cosines), 0.05)
    factors = median(density / facing)
    misfits = median(np.abs(density - factors[:, None] * facing)) / factors
    outward = np.sign(cosines) @ (offsets * normals).sum(axis=1)
    bulges = np.abs(outward) / len(offsets) / np.sqrt((offsets**2).sum(axis=1).mean())
    best: Array = directions[(misfits - BULGE_WEIGHT * bulges).argmin()]
    return best


def hidden_share(points: Array, direction: Array, cell: float, landmark: Array) -> float:
    """Share of the points (N, 3) that others hide from a sensor far away in a direction (3,)."""
    return float(hidden(points, direction[None], landmark, cell, DEPTH * cell)[0])


def side(points: Array, normals: Array, direction: Array) -> float:
    """1 if the sensor is rather where the direction points, -1 if rather behind the surface."""
    facing = normals @ direction
    outward = np.where(facing[:, None] < 0, -normals, normals)
    offsets = points - points.mean(axis=0)
    size = np.sqrt((offsets**2).sum(axis=1).mean())
    heights, steepness = offsets @ direction, np.abs(facing)
    spread = heights.std() * steepness.std()
    bulge = (offsets * outward).sum() / len(points) / (size or 1.0)
    related = (heights * (steepness - steepness.mean())).mean() / (spread or 1.0)
    return 1.0 if bulge + FACING_WEIGHT * related >= 0 else -1.0
