"""What the sensor of a scan saw: a z-buffer whose pixels are the scan's own rays."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from mvreg.kernels.rays import Rays
from mvreg.surface.sensor import SensorModel, sensor_of, told_sensor
from mvreg.surface.sensor_direction import estimated_direction as estimated_direction
from mvreg.types import Array, Model, Scan, View
from mvreg.types.lazy import kept_on_argument


class Sensor(Enum):
    """Where the sensor of a scan is taken to be.

    `known` is what the scan says, its view direction or else its view point; a scan that says
    nothing has no say then. `estimated` falls back on `mvreg.surface.sensor.estimated_sensor` for
    such scans.
    """

    known = "known"
    estimated = "estimated"


@kept_on_argument
def scan_of(view: View) -> Scan:
    """The scan of a view; one of the view's own points where it has none."""
    return Scan(view.name, view.points) if view.scan is None else view.scan


@dataclass(frozen=True, eq=False)
class RangeImage:
    """The rays of one scan, ready to be asked what lies in front of it, and what behind.

    No grid of pixels: a query is answered by the scan's nearest rays, so that the answer does not
    depend on how a grid lies, nor on its scan's frame.

    Parameters
    ----------
    points : (N, 3) array
        Of the scan, in its frame.
    direction : (3,) array or None
        Unit, towards a sensor far away: the rays are parallel.
    origin : (3,) array or None
        The sensor's position, where there is no direction: the rays meet there.
    """

    points: Array
    direction: Array | None
    origin: Array | None
    _rays: dict[float, Rays] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, view: View, sensor: Sensor) -> RangeImage | None:
        """The range image of a view; None where nothing is known of the sensor.

        A merged model was seen from all around, and has none.
        """
        if isinstance(view, Model):
            return None
        scan = scan_of(view)
        model = sensor_of(scan) if sensor is Sensor.estimated else told_sensor(scan)
        return None if model is None else cls(scan.points, model.direction, model.point)

    def towards(self, points: Array) -> Array:
        """Unit vectors (M, 3) from points in the scan's frame towards the sensor."""
        return SensorModel(self.direction, self.origin).towards(points)

    def rays(self, reach: float) -> Rays:
        """The scan's own rays, to be asked for those within `reach` (length); kept."""
        if reach not in self._rays:
            self._rays[reach] = Rays(self.points, self.direction, self.origin, reach)
        return self._rays[reach]

    def nearby(self, points: Array, reach: float, count: int) -> tuple[Array, Array, Array]:
        """Heights of points, and of the scan's surface about their rays.

        Parameters
        ----------
        points : (M, 3) array
            In the scan's frame.
        reach : float
            How far from a point's ray the scan's rays are asked (length).
        count : int
            How many of them, the nearest ones, at most; 64 at most.

        Returns
        -------
        height, low, high : (M,) arrays
            `low` and `high` are NaN where the scan has no ray that near.
        """
        return self.rays(reach).nearby(points, count)
