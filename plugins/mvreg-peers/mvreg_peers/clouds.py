"""Raw scans in a frame and a unit that no parameter of a peer depends on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import median_spacing
from mvreg.types import Array, View


@dataclass(frozen=True, eq=False)
class Cloud:
    """The raw points of a view about their mean `centre` (3,), one resolution being 1.

    `points` (N, 3); `unit` is the length of one resolution in the unit of the scans.
    """

    points: Array
    centre: Array
    unit: float


def clouds_of(views: Sequence[View]) -> list[Cloud]:
    """The raw scans behind the views; the points of a view that has no scan.

    The unit is the median over the scans of the mean distance between neighbours. Where every scan
    is a single point it is zero, and the clouds are empty: they say nothing.
    """
    raw = [view.points if view.scan is None else view.scan.points for view in views]
    unit = median_spacing(raw)
    clouds = []
    for points in raw:
        centre = points.mean(axis=0)
        scaled = (points - centre) / unit if unit > 0 else np.empty((0, 3))
        clouds.append(Cloud(scaled, centre, unit))
    return clouds


def in_scan_frames(pose: Array, source: Cloud, target: Cloud) -> Array:
    """``T_target_source`` (4, 4) of the scans, from that of their clouds."""
    rigid = se3.project(pose)
    rotation = rigid[:3, :3]
    shift = source.unit * rigid[:3, 3] + target.centre - rotation @ source.centre
    return se3.from_parts(rotation, shift)
