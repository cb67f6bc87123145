"""Write clouds as LAS and LAZ, piece by piece, with laspy."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.io.cloud import PointCloud
from mvreg.io.cloud_stream import ROWS, Survey, replaced, survey_spacing
from mvreg.types import Array
from mvreg.types.attributes import COLOURS, Values

#: What LAS has a place for in every point, and the largest value that fits; none is negative.
STANDARD = {
    "intensity": 65535, "classification": 255, "user_data": 255, "point_source_id": 65535,
    "return_number": 15, "number_of_returns": 15,
}  # fmt: skip
#: Coordinates are whole numbers of 32 bits; some room is left for rounding.
LARGEST = 2**31 - 16
#: Bytes of the name of an attribute that LAS has no place for.
LONGEST_NAME = 32


def scale_for(spacing: float, extent: float) -> float:
    """The unit in which LAS counts coordinates: a power of ten, at most spacing / 1000.

    Coarser only where the extent would not fit 32 bits otherwise.

    Parameters
    ----------
    spacing : float
        Mean distance of a point to the nearest other one (length); 0 where all are in one place.
    extent : float
        Of the cloud, along its longest axis (length).
    """
    wanted = spacing if spacing > 0 else extent if extent > 0 else 1.0
    finest = math.floor(math.log10(wanted / 1000) + 1e-9)
    # One more than the extent, for the rounding of the offset.
    while extent / 10.0**finest + 1e6 > LARGEST:
        finest += 1
    return float(f"1e{finest}")


def offset_for(lower: Array, scale: float) -> Array:
    """The smallest coordinates (3,), rounded down to a million of the unit."""
    step = float(f"1e{round(math.log10(scale)) + 6}")
    rounded: Array = np.floor(lower / step) * step
    return rounded


def write_las_clouds(
    path: str | Path,
    clouds: Iterable[PointCloud],
    kinds: Mapping[str, np.dtype[Any]],
    probes: Mapping[str, Array] | None = None,
) -> list[str]:
    """Write clouds into one file, one after the other; only one need be in memory at a time.

    LAS 1.4, point format 6, or 7 with colours. Scale and offset are chosen for these points, see
    `scale_for`: coordinates are kept to half a thousandth of the spacing of the finest cloud.
    Colours of 8 bits are spread over 16, times 257, as the specification wants them. Attributes
    that LAS has no place for, or whose values do not fit there, are "extra bytes" of their type.

    Parameters
    ----------
    path : str or Path
        Compressed if it ends in ``.laz``. Missing folders are made; an existing file is replaced.
    clouds : iterable of PointCloud
        Gone through twice, so no iterator. A cloud that lacks an attribute gets NaN, or 0 where
        the type is whole.
    kinds : mapping of str to dtype
        The attributes and their types.
    probes : mapping of str to (N, 3) array, optional
        Some points of scans that come as several clouds, by name, to measure their spacing.

    Returns
    -------
    list of str
        What could not be kept as it is, in words.

    Raises
    ------
    InputError
        If there are no points, or the file cannot be written.
    """
    import laspy

    path = Path(path)
    seen, spacing = survey_spacing(clouds, path, probes)
    extent = float((seen.upper - seen.lower).max())
    scale = scale_for(spacing, extent)
    coloured = set(COLOURS) <= kinds.keys()
    header = laspy.LasHeader(version="1.4", point_format=7 if coloured else 6)
    header.scales = np.full(3, scale)
    header.offsets = offset_for(seen.lower, scale)
    header.generating_software = "mvreg"
    places = _places(kinds, seen, coloured)
    extra = [
        laspy.ExtraBytesParams(name=place, type=_kind(kinds[name]), description="")
        for name, place in places.items()
        if place not in (*STANDARD, *COLOURS, "gps_time")
    ]
    header.add_extra_dims(extra)
    with replaced(path) as part, laspy.open(part, mode="w", header=header) as stream:
        for cloud in clouds:
            for first in range(0, len(cloud.points), ROWS):
                piece = slice(first, first + ROWS)
                stream.write_points(_record(cloud, piece, header, places, kinds))
    remarks = []
    if spacing > 0 and scale > spacing / 999:
        remarks.append(f"{path.name}: coordinates in units of {scale:g}, as finer ones would not "
                       f"fit the 32 bits that LAS has for an extent of {extent:g}")  # fmt: skip
    for name, place in places.items():
        if place != name:
            remarks.append(f"{path.name}: {name!r} is written as {place!r}")
    return remarks


def _places(kinds: Mapping[str, np.dtype[Any]], seen: Survey, coloured: bool) -> dict[str, str]:
    """Where each attribute goes: a dimension of LAS's own, or one of its name."""
    import laspy

    own = {n.casefold() for n in laspy.PointFormat(7).dimension_names} | {"x", "y", "z"}
    taken = set(own)
    found: dict[str, str] = {}
    for name, kind in kinds.items():
        whole = kind.kind in "ui" and name in STANDARD and seen.within(name, 0, STANDARD[name])
        colour = coloured and name in COLOURS and kind.kind == "u" and kind.itemsize <= 2
        if whole or colour or (name == "gps_time" and kind.kind == "f"):
            found[name] = name
            continue
        stem = _shortened("".join(c if "!" <= c <= "~" else "_" for c in name) or "scalar")
        place, number = stem, 1
        while place.casefold() in taken:
            number += 1
            place = f"{_shortened(stem, 3)}_{number}"
        taken.add(place.casefold())
        found[name] = place
    return found


def _shortened(name: str, room: int = 0) -> str:
    return name[: LONGEST_NAME - room]


def _kind(kind: np.dtype[Any]) -> str:
    """A type of extra bytes: laspy writes a byte for what is true or false."""
    return "u1" if kind.kind == "b" else "f4" if kind.str[1:] == "f2" else kind.str[1:]


def _record(
    cloud: PointCloud,
    piece: slice,
    header: Any,
    places: Mapping[str, str],
    kinds: Mapping[str, np.dtype[Any]],
) -> Any:
    import laspy

    points = cloud.points[piece]
    record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    # Rounded here: assigning to record.x would do, but has its own idea of the range.
    for axis, column, offset in zip("XYZ", points.T, header.offsets, strict=True):
        record[axis] = np.rint((column - offset) / header.scales[0]).astype(np.int32)
    for name, place in places.items():
        values: Values | None = cloud.attributes.get(name)
        if values is not None:
            values = values[piece]
            wide = name in COLOURS and place == name and kinds[name].itemsize == 1
            record[place] = values.astype(np.uint16) * np.uint16(257) if wide else values
        elif kinds[name].kind == "f":
            record[place] = np.full(len(points), np.nan)
    if "return_number" not in places:
        record["return_number"] = np.ones(len(points), dtype=np.uint8)
    if "number_of_returns" not in places:
        record["number_of_returns"] = np.ones(len(points), dtype=np.uint8)
    return record
