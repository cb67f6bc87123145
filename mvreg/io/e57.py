"""Read E57 files through libe57, as pye57 brings it.

Not through pye57's own functions: those of 0.4.19 refuse colours of 16 bits and row indices beyond
16 bits, take poses by the order of their parts, and fail where an optional field is missing.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io.cloud import PointCloud
from mvreg.types import Array
from mvreg.types.attributes import COLOURS, Values

#: Points at a time: what is made of a header that lies stays small.
_CHUNK = 200_000
_XYZ = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_GRID = ("rowIndex", "columnIndex")
_NAMES = {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue", "nor:normalX": "nx",
          "nor:normalY": "ny", "nor:normalZ": "nz"}  # fmt: skip
#: libe57 reads XML by a library with state of its own: one thread at a time.
_ONE = Lock()


def read_e57(path: Path) -> Iterator[PointCloud]:
    """Read the scans of a file, in double precision, each in its own frame, with its pose.

    Points with an invalid state are left out, with a remark. The sensor is at the origin of a
    scan's frame where the file has it as a scanner saw it: in spherical coordinates, by row and
    column, or with a pose other than the identity, which writers write regardless. The format
    does not say whether a scanner was levelled.

    Raises
    ------
    InputError
        With file, byte or scan, and reason; where pye57 is not installed, how to install it.
    """
    _check_size(path)
    try:
        from pye57 import libe57
    except ImportError as error:
        raise InputError(
            f"{path}: E57 files are read through pye57, which is not installed; "
            "pip install 'mvreg[e57]'"
        ) from error
    with _ONE:
        image = None
        try:
            image = libe57.ImageFile(str(path), "r")
            scans = image.root()["data3D"]
            empty: list[str] = []
            for i in range(len(scans)):
                cloud = _scan(libe57, image, scans[i], f"scan{i + 1}", path)
                if not len(cloud.points):
                    empty.append(cloud.name)
                    continue
                if empty:
                    without = f"scans without points left out: {', '.join(empty)}"
                    cloud = replace(cloud, remarks=(*cloud.remarks, without))
                    empty = []
                yield cloud
        except (InputError, OSError, MemoryError):
            raise
        except Exception as error:  # libe57 and NumPy raise as they please
            reason = str(error).strip().split("\n")[0] or type(error).__name__
            raise InputError(f"{path}: not a readable E57 file: {reason}") from error
        finally:
            if image is not None:
                image.close()


def _check_size(path: Path) -> None:
    with path.open("rb") as stream:
        head = stream.read(48)
        size = stream.seek(0, 2)
    if head[:8] != b"ASTM-E57":
        raise InputError(f"{path}, byte 0: expected 'ASTM-E57', got {head[:8]!r}")
    if len(head) < 48:
        raise InputError(f"{path}, byte {size}: the file ends within its header; truncated")
    length, xml, xml_length, page = struct.unpack_from("<4Q", head, 16)
    if length != size or xml + xml_length > size or page != 1024:
        raise InputError(
            f"{path}, byte 16: the header tells of {length} bytes in pages of {page}, found "
            f"{size}; the file is truncated or damaged"
        )


def _scan(libe57: Any, image: Any, node: Any, name: str, path: Path) -> PointCloud:
    name = str(node["name"].value()) if node.isDefined("name") else name
    where = f"{path}, scan {name!r}"
    points = node["points"]
    prototype = libe57.StructureNode(points.prototype())
    fields = [prototype.get(i).elementName() for i in range(prototype.childCount())]
    spherical = not set(_XYZ) <= set(fields)
    axes = _SPHERICAL if spherical else _XYZ
    if not set(axes) <= set(fields):
        raise InputError(f"{where}: expected Cartesian or spherical points, found {fields}")
    state = "sphericalInvalidState" if spherical else "cartesianInvalidState"
    pose, remarks = _pose(node)
    wanted = [
        *axes, *(f for f in (*_NAMES, "intensity", *_GRID, state, "timeStamp") if f in fields)
    ]  # fmt: skip
    table = _read(libe57, image, points, wanted, where)
    xyz = np.stack([table.pop(axis) for axis in axes], axis=1)
    if state in table:
        valid = table.pop(state) == 0
        if not valid.all():
            left_out = int(np.count_nonzero(~valid))
            remarks = (*remarks, f"{left_out:,} of {len(valid):,} points without a return left out")
            xyz = xyz[valid]
            table = {field: values[valid] for field, values in table.items()}
    at_origin = spherical or set(_GRID) <= set(fields)
    at_origin |= pose is not None and not np.array_equal(pose, np.eye(4))
    return PointCloud(
        _cartesian(xyz) if spherical else xyz,
        np.zeros(3) if at_origin else None,
        _attributes(table, node, prototype),
        name,
        pose,
        remarks=remarks,
    )


def _read(
    libe57: Any, image: Any, points: Any, fields: list[str], where: str
) -> dict[str, Values]:  # fmt: skip
    """Columns by field, all as doubles, which hold integers up to 2**53 exactly."""
    count = int(points.childCount())
    if count == 0:
        return {field: np.empty(0) for field in fields}
    size = min(count, _CHUNK)
    columns = {field: np.empty(size) for field in fields}
    buffers = libe57.VectorSourceDestBuffer()
    for field, column in columns.items():
        buffers.append(libe57.SourceDestBuffer(image, field, column, size, True, True))
    reader = points.reader(buffers)
    parts: dict[str, list[Values]] = {field: [] for field in fields}
    found = 0
    try:
        while found <= count and (more := int(reader.read())):
            found += more
            for field, column in columns.items():
                parts[field].append(column[:more].copy())
    finally:
        reader.close()
    if found != count:
        raise InputError(f"{where}: {count} points are announced, but {found} could be read")
    return {field: np.concatenate(each) for field, each in parts.items()}


def _cartesian(spherical: Array) -> Array:
    """Of range, azimuth and elevation (N, 3), with angles in radians."""
    distance, azimuth, elevation = spherical.T
    level = distance * np.cos(elevation)
    return np.stack(
        [level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)], axis=1
    )


def _pose(node: Any) -> tuple[Array | None, tuple[str, ...]]:
    if not node.isDefined("pose"):
        return None, ()
    pose = node["pose"]
    turn, shift = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3)
    if pose.isDefined("rotation"):
        turn = np.array([float(pose["rotation"][part].value()) for part in "xyzw"])
    if pose.isDefined("translation"):
        shift = np.array([float(pose["translation"][part].value()) for part in "xyz"])
    if not (np.isfinite(shift).all() and 1e-6 < np.linalg.norm(turn) < 1e6):
        return None, ("its pose is no rigid motion and was left out",)
    return se3.from_parts(se3.rotation_from_quaternion(turn), shift), ()


def _attributes(table: dict[str, Values], node: Any, prototype: Any) -> dict[str, Values]:
    found: dict[str, Values] = {}
    for field, values in table.items():
        name = _NAMES.get(field, field)
        if name in COLOURS:
            found[name] = _colour(values, field, node, prototype)
        elif field in _GRID:
            found[name] = values.astype(np.int64)
        else:
            found[name] = values
    return found


def _colour(values: Values, field: str, node: Any, prototype: Any) -> Values:
    """As integers of 8 bits where the file's are, else of 16: the file says how far they go."""
    low, high = 0.0, float(prototype[field].maximum())
    if node.isDefined("colorLimits") and node["colorLimits"].isDefined(f"{field}Maximum"):
        low = float(node["colorLimits"][f"{field}Minimum"].value())
        high = float(node["colorLimits"][f"{field}Maximum"].value())
    whole = bool(np.all(values == np.round(values)))
    top = float(values.max(initial=0.0))
    if whole and values.min(initial=0.0) >= 0 and top <= 65535 and high > 1:
        return values.astype(np.uint8 if max(top, high) <= 255 else np.uint16)
    width = high - low if np.isfinite(high - low) and high > low else 1.0
    return (np.clip((values - low) / width, 0, 1) * 65535).round().astype(np.uint16)
