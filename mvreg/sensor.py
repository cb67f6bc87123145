"""What the sensor of a scan saw: a z-buffer whose pixels are the scan's own rays."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mvreg.nearest import build_tree, neighbours_of
from mvreg.sensor_estimate import estimated_direction as estimated_direction
from mvreg.types import Array, Model, View

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree


class Sensor(Enum):
    """Where the sensor of a scan is taken to be.

    `known` is what the scan says, its view direction or else its view point; a scan that says
    nothing has no say then. `estimated` falls back on `estimated_direction` for such scans.
    """

    known = "known"
    estimated = "estimated"


@dataclass(frozen=True, eq=False)
class Rays:
    """Points as a sensor sees them.

    `across` (N, 3) tells rays apart: points on one ray share it, and distances between rays are
    lengths at the scan's own mean distance; `height` (N,) grows towards the sensor.
    """

    across: Array
    height: Array


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

    @classmethod
    def of(cls, view: View, sensor: Sensor) -> RangeImage | None:
        """The range image of a view; None where nothing is known of the sensor.

        A merged model was seen from all around, and has none.
        """
        if isinstance(view, Model):
            return None
        scan = view.scan
        points = view.points if scan is None else scan.points
        if scan is not None and scan.view_direction is not None:
            return cls(points, scan.view_direction, None)
        if scan is not None and scan.view_point is not None:
            return cls(points, None, scan.view_point)
        if sensor is Sensor.known:
            return None
        direction = estimated_direction(view)
        return None if direction is None else cls(points, direction, None)

    @cached_property
    def distance(self) -> float:
        """Mean distance of the points from the origin of the rays."""
        assert self.origin is not None
        return float(np.linalg.norm(self.points - self.origin, axis=1).mean())

    def rays(self, points: Array) -> Rays:
        """Look at `points` (M, 3), in the scan's frame."""
        if self.direction is not None:
            height = points @ self.direction
            return Rays(points - height[:, None] * self.direction, height)
        assert self.origin is not None
        away = points - self.origin
        length = np.linalg.norm(away, axis=1)
        unit = away / np.maximum(length, np.finfo(float).tiny)[:, None]
        return Rays(self.distance * unit, -length)

    def towards(self, points: Array) -> Array:
        """Unit vectors (M, 3) from points in the scan's frame towards the sensor."""
        if self.direction is not None:
            return np.broadcast_to(self.direction, points.shape)
        assert self.origin is not None
        away = self.origin - points
        length = np.linalg.norm(away, axis=1, keepdims=True)
        unit: Array = away / np.maximum(length, np.finfo(float).tiny)
        return unit

    @cached_property
    def seen(self) -> Rays:
        """The scan's own rays."""
        return self.rays(self.points)

    @cached_property
    def tree(self) -> Tree:
        """k-d tree over the scan's own rays."""
        return build_tree(self.seen.across)

    def nearby(self, points: Array, reach: float, count: int) -> tuple[Array, Array, Array]:
        """Heights of points, and of the scan's surface about their rays.

        Parameters
        ----------
        points : (M, 3) array
            In the scan's frame.
        reach : float
            How far from a point's ray the scan's rays are asked (length).
        count : int
            How many of them, the nearest ones, at most.

        Returns
        -------
        height, low, high : (M,) arrays
            `low` and `high` are NaN where the scan has no ray that near.
        """
        looked = self.rays(points)
        count = min(count, len(self.points))
        distances, indices = neighbours_of(self.tree, looked.across, count, reach)
        found = np.isfinite(distances)
        heights = np.append(self.seen.height, 0.0)[indices]
        missed = ~found.any(axis=1)
        low = np.where(found, heights, np.inf).min(axis=1)
        high = np.where(found, heights, -np.inf).max(axis=1)
        low[missed] = high[missed] = np.nan
        return looked.height, low, high
