"""What two range scans show of each other under a pose: counts and sums, ready to be pooled."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mvreg import se3
from mvreg.nearest import within
from mvreg.sensor import RangeImage, Sensor
from mvreg.surfaces import LEAST_COSINE
from mvreg.types import Array, Indices, View

Flags = NDArray[np.bool_]

#: Points asked per view: shares of so many are known to two per cent.
MOST_POINTS = 1200
#: Raw points that the noise floor of a scan is measured with.
FLOOR_POINTS = 500
#: Neighbours further apart than this are no overlap (resolutions).
REACH = 2.0
#: How far in front of a surface a point may be and still lie on it (resolutions).
TOLERANCE = 2.0
#: A point whose so-manieth neighbour is so many times farther than usual is not of the surface.
COMPANY, STRAY = 4, 3.0
#: How many of a sensor's rays answer for a point, and how near they must be (resolutions).
RAYS, RAY_REACH = 4, 1.0
#: No scan is trusted to be better than this (resolutions): synthetic ones may have no noise at all.
LEAST_FLOOR = 0.03


@dataclass(frozen=True, eq=False)
class Witness:
    """What one view brings to every meeting, made ready once.

    Parameters
    ----------
    points, normals : (P, 3) arrays
        Some of the view's points, evenly from its list.
    image : RangeImage or None
        What its sensor saw; None where nothing is known of that, nor can be told.
    known : bool
        Whether the scan itself says where its sensor was.
    reach : float
        Points further from the view's than this are not on its surface (length).
    floor : float
        Root mean square distance of the scan's own other points to the planes of the view: noise,
        and what the surface curves between points (length).
    """

    points: Array
    normals: Array
    image: RangeImage | None
    known: bool
    reach: float
    floor: float


_witnesses: WeakKeyDictionary[View, Witness] = WeakKeyDictionary()


def witness(view: View) -> Witness:
    """The view made ready; remembered as long as the view lives."""
    found = _witnesses.get(view)
    if found is None:
        found = _witnesses[view] = _prepare(view)
    return found


def _prepare(view: View) -> Witness:
    reach = REACH * max(view.scale.resolution, view.resolution)
    known = view.scan is not None and view.scan.knows_sensor
    asked = _surface_points(view)
    return Witness(
        view.points[asked], view.normals[asked], RangeImage.of(view, Sensor.estimated),
        known, reach, max(_noise_floor(view, reach), LEAST_FLOOR * view.scale.resolution),
    )  # fmt: skip


def _surface_points(view: View) -> Indices:
    """Positions of some of the view's points, evenly from its list, less what strays alone."""
    asked: Indices = np.arange(0, len(view.points), max(1, -(-len(view.points) // MOST_POINTS)))
    if len(view.points) <= COMPANY:
        return asked
    distances, _ = view.tree.query(view.points[asked], k=[COMPANY + 1])
    stray = distances[:, 0] > STRAY * np.median(distances)
    kept: Indices = asked[~stray]
    return kept


def _noise_floor(view: View, reach: float) -> float:
    """How far a scan's own other points are from the view's planes (RMS, length)."""
    if len(view.points) < 2:
        return 0.0
    own = view.scan is None or len(view.scan.points) < 2 * len(view.points)
    points = view.points if own or view.scan is None else view.scan.points
    step = -(-len(points) // FLOOR_POINTS)
    queries = points[step // 2 :: step]
    distances, indices = view.tree.query(queries, k=2, distance_upper_bound=reach)
    # A point that is itself one of the view's says nothing: its neighbour does.
    same = distances[:, 0] <= 1e-6 * reach
    distance = np.where(same, distances[:, 1], distances[:, 0])
    index = np.where(same, indices[:, 1], indices[:, 0])
    met = np.isfinite(distance)
    gaps = queries[met] - view.points[index[met]]
    heights = (gaps * view.normals[index[met]]).sum(axis=1)
    return float(np.sqrt((heights**2).mean())) if met.any() else 0.0


@dataclass(frozen=True, eq=False)
class Side:
    """What the points of one view show on the surface of another.

    Parameters
    ----------
    met : (P,) array of bool
        Which of the points lie on the surface, normals agreeing.
    near : int
        How many are that near, whatever their normals.
    heights : (M,) array
        Signed distances of those met to the other's planes (resolutions).
    spots, own, planes : (M, 3) arrays
        Where they meet, their own normals and the other's there, in the frame of their view.
    consistent, front : int
        Points that lie on what the other's sensor saw, and those in front of it, in what it saw to
        be free.
    told, known : bool
        False where nothing can be told of the other's sensor; `known` where the scan says it.
    floor : float
        The noise floor of the two views (resolutions).
    """

    met: Flags
    near: int
    heights: Array
    spots: Array
    own: Array
    planes: Array
    consistent: int
    front: int
    told: bool
    known: bool
    floor: float


def look(moving: View, still: View, T_still_moving: Array) -> Side:
    """What the points of `moving` show on the surface of `still`; spots are in `moving`'s frame."""
    here, there = witness(moving), witness(still)
    points = se3.apply(T_still_moving, here.points)
    near, partners, _ = within(still.tree, points, there.reach)
    turned = here.normals[near] @ T_still_moving[:3, :3].T
    planes = still.normals[partners]
    cosines = (turned * planes).sum(axis=1)
    if not (moving.features.oriented and still.features.oriented):
        planes = np.where(cosines[:, None] < 0, -planes, planes)
        cosines = np.abs(cosines)
    agree = cosines > LEAST_COSINE
    chosen, planes = near[agree], planes[agree]
    unit = moving.scale.resolution or 1.0
    heights = ((points[chosen] - still.points[partners[agree]]) * planes).sum(axis=1) / unit
    floor = np.sqrt((here.floor**2 + there.floor**2) / 2) / unit
    met = np.zeros(len(points), dtype=bool)
    met[chosen] = True
    consistent, front = _seen(there.image, points, still)
    return Side(
        met, len(near), heights,
        here.points[chosen], here.normals[chosen], planes @ T_still_moving[:3, :3],
        consistent, front,
        there.image is not None, there.known, float(floor),
    )  # fmt: skip


def _seen(image: RangeImage | None, points: Array, still: View) -> tuple[int, int]:
    """How many points lie on what a sensor saw, and how many in front of it."""
    if image is None or not len(points):
        return 0, 0
    resolution = max(still.scale.resolution, still.resolution)
    height, low, high = image.nearby(points, RAY_REACH * resolution, RAYS)
    front = height > high + TOLERANCE * resolution
    behind = height < low - TOLERANCE * resolution
    consistent = ~np.isnan(low) & ~front & ~behind
    return int(consistent.sum()), int(front.sum())
