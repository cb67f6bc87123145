"""The sensor model of a scan: what the scan says, or what its points tell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.geometry.nearest import build_tree, mean_spacing
from mvreg.surface.sensor_direction import HIDING_POINTS, estimated_axis, side
from mvreg.surface.sensor_position import (
    hidden_from,
    positions,
    residuals,
    sampled,
    spread,
)
from mvreg.types import Array, Features, Scale, Scan, View
from mvreg.types.lazy import kept_on_argument

#: A sensor farther from the middle of a scan than so many lengths of it is far away: its rays count
#: as parallel. The figurine's is 3 to 4 lengths away, the Bunny's and the Buddha's 5 and more.
FAR = 5.0
#: The position on the other side of the scan, mirrored, must leave so many times the spread, or
#: densities do not tell on which side the sensor was. Of 40 Stanford scans, whose sensor is nearly
#: orthographic, three are told wrongly with 1.2 at most; of a bowl, a sheet, a room and a desk all
#: are told rightly, with 1.9 and more.
SIDE_GAIN = 1.5
#: A near position is taken only with so many times: the right ones of RGB-D frames and of a tilting
#: laser have 3.0 to 15, wrong ones of a multi-beam scanner, whose rings have densities of their
#: own, 2.7 at most, but for one that hides a fifth of its points.
POINT_GAIN = 2.9
#: Or it leaves so little of the spread that there was, as inside a panorama, where mirroring moves
#: it by nothing: 0.1 to 0.32 in rooms, courts and streets, 0.36 and more if wrong.
CLEARLY_LEFT = 0.33
#: A near position may leave a spread of `MOST_SPREAD`, or `LEFT` of what there was: RGB-D frames
#: leave 0.15 to 0.22, a tilting laser 0.3 of 1.2. It may hide so many points: the true positions
#: in the office hide 0.07 to 0.09, since the beam is as wide as an edge.
MOST_SPREAD, LEFT, MOST_HIDDEN = 0.25, 0.4, 0.15
#: A sensor whose position seems to be nearer to the middle of the scan than so many lengths of it
#: is not far away, wherever it is.
OUTSIDE = 0.5
#: A sensor far away must leave less: the Stanford scans leave 0.04 to 0.07, the figurine's 0.05.
FAR_SPREAD = 0.15


@dataclass(frozen=True, eq=False)
class SensorModel:
    """Where a scan's rays came from, in the frame of the scan.

    `direction` (3,) is a unit vector towards a sensor far away; `point` (3,) is the position of one
    where the rays meet. One of the two is None.
    """

    direction: Array | None
    point: Array | None

    def towards(self, points: Array) -> Array:
        """Unit vectors (M, 3) from points (M, 3) towards the sensor."""
        if self.direction is not None:
            return np.broadcast_to(self.direction, points.shape)
        assert self.point is not None
        away = self.point - points
        length = np.linalg.norm(away, axis=1, keepdims=True)
        unit: Array = away / np.maximum(length, np.finfo(float).tiny)
        return unit


def told_sensor(scan: Scan) -> SensorModel | None:
    """What the scan says itself: its view direction, or else its view point; None for neither."""
    if scan.view_direction is not None:
        return SensorModel(scan.view_direction, None)
    if scan.view_point is not None:
        return SensorModel(None, scan.view_point)
    return None


def sensor_of(scan: Scan) -> SensorModel | None:
    """What the scan says, or else what its points tell."""
    return told_sensor(scan) or estimated_sensor(scan)


@kept_on_argument
def estimated_sensor(scan: Scan) -> SensorModel | None:
    """The sensor model that explains how densely the points lie, whatever the scan says.

    A range image samples directions evenly, so that density follows distance and incidence; and no
    point hides another from the sensor. Where neither a near nor a far sensor explains the
    densities, as of a fused model, of beams in rings or of an even thinning, there is none: a wrong
    one is worse. Kept on the scan.

    Returns
    -------
    SensorModel or None
        None for what no single sensor saw, and for too few points.
    """
    own = sampled(scan)
    if own is None:
        return None
    raw = float(spread(own.density))
    middle = own.points.mean(axis=0)
    size = float(np.linalg.norm(np.ptp(own.points, axis=0)))
    (best, least), image = positions(own)

    def gain(point: Array, left: float) -> float:
        return float(spread(residuals(2 * middle - point, own))) / max(left, 1e-9)

    for point, left in ((best, least), image):
        clear = left <= CLEARLY_LEFT * raw or gain(point, left) >= POINT_GAIN
        near = np.linalg.norm(point - middle) < FAR * size and left <= max(MOST_SPREAD, LEFT * raw)
        if clear and near and hidden_from(scan.points, point) <= MOST_HIDDEN:
            return SensorModel(None, point)
    towards = best - middle
    if least > FAR_SPREAD or np.linalg.norm(towards) < OUTSIDE * size:
        return None
    return _far_away(scan, towards if gain(best, least) >= SIDE_GAIN else None)


def _far_away(scan: Scan, towards: Array | None) -> SensorModel | None:
    """A sensor far away; the side is that of a vector, or told by the shape where there is none."""
    view = _thinned(scan)
    axis = estimated_axis(view)
    if axis is None:
        return None
    if towards is None:
        sign = side(view.points, view.normals, axis)
    else:
        sign = 1.0 if axis @ towards >= 0 else -1.0
    return SensorModel(sign * axis, None)


def _thinned(scan: Scan) -> View:
    """Some points of a scan with their normals, as a view without features."""
    from mvreg.kernels.moments import normals as plane_normals

    points = scan.points[:: max(1, -(-len(scan.points) // HIDING_POINTS))]
    resolution = mean_spacing(points, build_tree(points))
    none = Features(np.empty((0, 3)), np.empty((0, 1, 3)), np.empty((0, 1)), oriented=False)
    normals = plane_normals(scan.tree, points, 20)
    return View(scan.name, points, normals, none, resolution, Scale(resolution, resolution), scan)
