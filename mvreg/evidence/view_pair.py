"""Evidence of one view about another under a relative pose: counts and sums, ready to be pooled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.arrays import Flags
from mvreg.kernels import evidence
from mvreg.kernels.rays import Rays
from mvreg.surface.overlap import LEAST_COSINE
from mvreg.surface.range_image import RangeImage, Sensor
from mvreg.types import Array, Indices, Model, View
from mvreg.types.lazy import kept_on_argument

#: Points sampled per view: shares of so many are known to two per cent.
MOST_POINTS = 1200
#: Raw points that the noise floor of a scan is measured with.
NOISE_FLOOR_POINTS = 500
#: Largest distance of a point from a surface that it lies on (resolutions).
EVIDENCE_DISTANCE = 2.0
#: How far in front of a surface a point may be and still lie on it (resolutions).
TOLERANCE = 2.0
#: A point whose n-th neighbour is this many times farther than the median is an outlier.
OUTLIER_NEIGHBOURS, OUTLIER_FACTOR = 4, 3.0
#: How many of a sensor's rays answer for a point, and how near they must be (resolutions). None
#: floats that is on what any ray met that is nearer than the last: of right pairs of a campus, of
#: RGB-D frames and of a tilting laser 2.1, 0.4 and 4.5 % of the points float, else 3, 1.6 and 7 %;
#: of wrong ones 26, 19 and 15 %, else 27, 25 and 19 %. With as much as a resolution the columns of
#: a hall would hide that it is a column off.
RAYS, RAY_REACH, EDGE = 4, 1.0, 0.5
#: Least noise floor (resolutions): synthetic ones may have no noise at all.
LEAST_NOISE_FLOOR = 0.03


@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """Samples of the surface of one view, prepared once for all its view pairs.

    Parameters
    ----------
    points, normals : (P, 3) arrays
        Some of the view's points, evenly from its list.
    image : RangeImage or None
        What its sensor saw; None where nothing is known of that, nor can be told.
    rays : Rays or None
        Those of the image.
    sensor_known : bool
        Whether the scan itself says where its sensor was.
    reach : float
        Points further from the view's than this are not on its surface (length).
    noise_floor : float
        Root mean square distance of the scan's own other points to the planes of the view: noise,
        and what the surface curves between points (length).
    centre, radius
        Of a ball around the points: (3,) array and length.
    """

    points: Array
    normals: Array
    image: RangeImage | None
    rays: Rays | None
    sensor_known: bool
    reach: float
    noise_floor: float
    centre: Array
    radius: float


@kept_on_argument
def surface_samples(view: View) -> SurfaceSamples:
    """The view made ready; kept on the view."""
    reach = EVIDENCE_DISTANCE * max(view.scale.resolution, view.resolution)
    sensor_known = view.scan is not None and view.scan.knows_sensor
    sampled = _surface_points(view)
    points = view.points[sampled]
    centre = points.mean(axis=0) if len(points) else np.zeros(3)
    radius = float(np.sqrt(((points - centre) ** 2).sum(axis=1).max(initial=0.0)))
    image = RangeImage.of(view, Sensor.estimated)
    rays = None if image is None else image.rays(_ray_reach(view))
    return SurfaceSamples(
        points, view.normals[sampled], image, rays, sensor_known, reach,
        max(_noise_floor(view, reach), LEAST_NOISE_FLOOR * view.scale.resolution), centre, radius,
    )  # fmt: skip


def _ray_reach(view: View) -> float:
    """How near a ray must be to answer for a point (length)."""
    return RAY_REACH * max(view.scale.resolution, view.resolution)


def _surface_points(view: View) -> Indices:
    """Positions of some of the view's points, evenly from its list, less what strays alone."""
    sampled: Indices = np.arange(0, len(view.points), max(1, -(-len(view.points) // MOST_POINTS)))
    if len(view.points) <= OUTLIER_NEIGHBOURS:
        return sampled
    distances, _ = view.tree.query(view.points[sampled], k=[OUTLIER_NEIGHBOURS + 1])
    outlier = distances[:, 0] > OUTLIER_FACTOR * np.median(distances)
    kept: Indices = sampled[~outlier]
    return kept


def _noise_floor(view: View, reach: float) -> float:
    """How far a scan's own other points are from the view's planes (RMS, length)."""
    if len(view.points) < 2:
        return 0.0
    own = view.scan is None or len(view.scan.points) < 2 * len(view.points)
    points = view.points if own or view.scan is None else view.scan.points
    step = -(-len(points) // NOISE_FLOOR_POINTS)
    queries = points[step // 2 :: step]
    distances, indices = view.tree.query(queries, k=2, distance_upper_bound=reach)
    # A point that is itself one of the view's says nothing: its neighbour does.
    same = distances[:, 0] <= 1e-6 * reach
    distance = np.where(same, distances[:, 1], distances[:, 0])
    index = np.where(same, indices[:, 1], indices[:, 0])
    in_contact = np.isfinite(distance)
    gaps = queries[in_contact] - view.points[index[in_contact]]
    heights = (gaps * view.normals[index[in_contact]]).sum(axis=1)
    return float(np.sqrt((heights**2).mean())) if in_contact.any() else 0.0


@dataclass(frozen=True, eq=False)
class DirectedEvidence:
    """Evidence of the points of one view on the surface of another.

    With p about `centre`, the points' own unit normals n and the other's planes' m in the frame of
    their view, and h the signed distances of those met to these planes:

    Parameters
    ----------
    in_contact : (P,) array of bool
        Which of the points lie on the surface, normals agreeing.
    count : int
        How many they are.
    near : int
        How many are that near, whatever their normals.
    squared : float
        Sum of ``h^2`` (resolutions^2).
    centre, first : (3,) arrays
        Near the points, in the frame of their view; the sum of p (length).
    second : float
        Sum of ``p^2`` (length^2).
    cross_information, information : (6, 6) arrays
        Sums of the products of ``[p x n, n]`` and ``[p x m, m]``, and of the latter and itself.
    gradient : (6,) array
        Sum of ``h [p x m, m]``, h in resolutions.
    consistent, front : int
        Points that lie on what the other's sensor saw, and those in front of it, in what it saw to
        be free.
    has_sensor, sensor_known : bool
        False where nothing is known of the other's sensor; `sensor_known` where the scan says it.
    noise_floor : float
        The noise floor of the two views (resolutions).
    """

    in_contact: Flags
    count: int
    near: int
    squared: float
    centre: Array
    first: Array
    second: float
    cross_information: Array
    information: Array
    gradient: Array
    consistent: int
    front: int
    has_sensor: bool
    sensor_known: bool
    noise_floor: float


@dataclass(frozen=True, eq=False)
class Homes:
    """The views of a model, ready to be asked which of them may meet another view.

    Parameters
    ----------
    T_view_model : (M, 4, 4) array
        The frames of the views.
    centres, radii, rays, reaches
        Of each, as in `SurfaceSamples`.
    """

    T_view_model: Array
    centres: Array
    radii: Array
    rays: tuple[Rays | None, ...]
    reaches: Array


@kept_on_argument
def homes(model: Model) -> Homes:
    """The views of a model; kept on the model."""
    samples = [surface_samples(part.view) for part in model.parts]
    return Homes(
        se3.invert(np.stack([part.T_model_scan for part in model.parts])),
        np.stack([one.centre for one in samples]), np.array([one.radius for one in samples]),
        tuple(one.rays for one in samples), np.array([one.reach for one in samples]),
    )  # fmt: skip


def parts_that_may_meet(
    source: View, model: Model, T_model_source: Array
) -> list[tuple[View, Array]]:
    """The views of a model that may have any contact with another one, in either direction.

    Returns
    -------
    list of (View, (4, 4) array)
        Each with ``T_view_source``.
    """
    here, there = surface_samples(source), homes(model)
    poses = there.T_view_model @ T_model_source
    may = evidence.which_may_overlap(
        here.centre, here.radius, here.rays, here.reach, there.centres, there.radii,
        list(there.rays), there.reaches, poses,
    )  # fmt: skip
    return [(model.parts[k].view, poses[k]) for k in np.flatnonzero(may)]


def directed_evidence(
    moving: View, still: View, T_still_moving: Array, step: int = 1
) -> DirectedEvidence:
    """Evidence of every `step`-th point of `moving` on the surface of `still`."""
    here, there = surface_samples(moving), surface_samples(still)
    reach = _ray_reach(still)
    seen = evidence.directed_evidence(
        still.tree, still.normals, here.points[::step], here.normals[::step],
        here.centre, here.radius,
        T_still_moving, there.reach, LEAST_COSINE,
        moving.features.oriented and still.features.oriented,
        there.rays, RAYS, TOLERANCE * reach / RAY_REACH, EDGE * reach / RAY_REACH,
    )  # fmt: skip
    unit = moving.scale.resolution or 1.0
    noise_floor = np.sqrt((here.noise_floor**2 + there.noise_floor**2) / 2) / unit
    return DirectedEvidence(
        seen.in_contact, int(seen.in_contact.sum()), seen.near, seen.squared / unit**2, here.centre,
        seen.first, seen.second, seen.cross_information, seen.information, seen.gradient / unit,
        seen.consistent, seen.front,
        there.rays is not None, there.sensor_known, float(noise_floor),
    )  # fmt: skip
