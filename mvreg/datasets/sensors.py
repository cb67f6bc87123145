"""Where the sensors stood: as the data set tells it, as the user does, or not at all; upright."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mvreg.errors import InputError
from mvreg.types import Array, Scan, ScanSet

AUTO, UNKNOWN, ORIGIN = "auto", "unknown", "origin"
#: From the surface towards the sensor, in the coordinates of each scan.
DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "+x": (1, 0, 0), "-x": (-1, 0, 0),
    "+y": (0, 1, 0), "-y": (0, -1, 0),
    "+z": (0, 0, 1), "-z": (0, 0, -1),
}  # fmt: skip
OPTIONS = (AUTO, UNKNOWN, ORIGIN, *DIRECTIONS)


def check_sensor(sensor: str) -> None:
    """Refuse what `tell_sensor` does not know.

    Raises
    ------
    InputError
        Lists the options.
    """
    if sensor not in OPTIONS:
        options = ", ".join(OPTIONS)
        raise InputError(f"dataset.sensor={sensor}: expected one of {options}")


def tell_sensor(scans: ScanSet, sensor: str) -> ScanSet:
    """The same scans, their sensors as `sensor` says; all frames are those of the scans.

    Parameters
    ----------
    scans : ScanSet
    sensor : str
        ``auto``: as they are; ``unknown``: nothing is known of any; ``origin``: a view point at
        the origin of each scan; ``+x`` to ``-z``: a view direction, from the surface towards the
        sensor. What the user says replaces what the scans knew.
    """
    if sensor == AUTO:
        return scans
    direction: Array | None = np.array(DIRECTIONS[sensor]) if sensor in DIRECTIONS else None
    point: Array | None = np.zeros(3) if sensor == ORIGIN else None
    return replace(
        scans,
        scans=tuple(_told(scan, direction, point) for scan in scans.scans),
        sensors={} if sensor == UNKNOWN else {scan.name: "user" for scan in scans.scans},
    )


def _told(scan: Scan, direction: Array | None, point: Array | None) -> Scan:
    return replace(scan, view_direction=direction, view_point=point)


def tell_upright(scans: ScanSet) -> ScanSet:
    """The same scans, levelled: the vertical of each is the +z of its own frame."""
    up = np.array([0.0, 0.0, 1.0])
    return replace(scans, scans=tuple(replace(scan, up=up) for scan in scans.scans))
