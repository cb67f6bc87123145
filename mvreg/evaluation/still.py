"""Whether the sensor stood still before what it saw, as before an object that was turned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.evaluation.component import ComponentEvidence
from mvreg.geometry import se3
from mvreg.surface.range_image import scan_of
from mvreg.surface.sensor import SensorModel, sensor_of
from mvreg.types import Array, View

#: What is said of the poses then.
STOOD_STILL = (
    "the sensor did not move relative to most of what was seen: if an object was turned, cut away "
    "what stood still"
)
#: Fewer scans may well be of one place.
FEWEST = 3
#: So large a share of the ordered pairs is to see the same: a scan or two may be of something else.
NEARLY_ALL = 0.8
#: So large a share of the sensors is to coincide: estimates may be missing, or go astray.
MOST = 0.5
#: Least contact ratio of scans of the same scenery. Before a turned object it is 0.99; between the
#: frames of a camera that pans or is carried 0.74 at most.
LEAST_CONTACT = 0.8
#: Sensors are in one place within this share of the scene's length, as they are estimated, or look
#: one way within this angle (degrees). Estimates of a camera that stood still are within 0.013,
#: those of one that moves by half a metre 0.03 to 0.07 off.
SAME_PLACE, SAME_DIRECTION = 0.02, 2.0
#: Mean of the unit vectors from the sensor to the points: 0.5 for a hemisphere, 0.9 and more for
#: the frame of a camera, 0.4 at most for a panorama, all of which see the same of one room.
LEAST_AHEAD = 0.5


def stood_still(part: ComponentEvidence) -> bool:
    """Whether the scans of a partial model see the same, and most of their sensors coincide.

    Then nothing tells a sensor that was not moved from scans that were registered by what stood
    still in all of them. Sensors are those that the scans tell, or else estimated; nothing is said
    where there is none, of fewer than three scans, nor of panoramas.
    """
    count = len(part.views)
    same = sum(contact.contact_ratio >= LEAST_CONTACT for contact in part.contacts)
    if count < FEWEST or same < NEARLY_ALL * count * (count - 1):
        return False
    least = max(FEWEST, MOST * count)
    points, directions = [], []
    for view in part.views:
        scan, pose = scan_of(view), part.poses[view.name]
        sensor = sensor_of(scan)
        if sensor is not None and sensor.direction is not None:
            directions.append(pose[:3, :3] @ sensor.direction)
        elif sensor is not None and sensor.point is not None and _ahead(view, sensor):
            points.append(se3.apply(pose, sensor.point[None])[0])
    return _near(points, SAME_PLACE * _length(part)) >= least or _parallel(directions) >= least


def _ahead(view: View, sensor: SensorModel) -> bool:
    """Whether all that the sensor saw lies to one side of it."""
    mean = sensor.towards(view.points).mean(axis=0)
    return float(np.linalg.norm(mean)) >= LEAST_AHEAD


def _length(part: ComponentEvidence) -> float:
    """The length of the scene: the diagonal of its box, without a twentieth at either end."""
    points = [se3.apply(part.poses[view.name], view.points) for view in part.views]
    low, high = np.quantile(np.concatenate(points), [0.05, 0.95], axis=0)
    return float(np.linalg.norm(high - low))


def _near(points: Sequence[Array], reach: float) -> int:
    """How many of the points (3,) are within `reach` of their median."""
    if not points:
        return 0
    away = np.linalg.norm(np.array(points) - np.median(points, axis=0), axis=1)
    return int((away <= reach).sum())


def _parallel(directions: Sequence[Array]) -> int:
    """How many of the unit vectors (3,) are within `SAME_DIRECTION` of their median."""
    if not directions:
        return 0
    middle = np.median(directions, axis=0)
    middle /= max(float(np.linalg.norm(middle)), 1e-9)
    return int((np.array(directions) @ middle >= np.cos(np.radians(SAME_DIRECTION))).sum())
