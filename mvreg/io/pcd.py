"""Read the points of a PCD file.

ASCII and binary are read here, because Open3D 0.20 completes a truncated file with zeros or with
whatever was in memory: a plausible wrong cloud. The compressed kind is Open3D's, once the sizes
that it states are found to be true.

The header's VIEWPOINT is taken as PCL takes it where it orients normals: the pose of the sensor in
the coordinates that the points have, so that its translation is the sensor's position. Points are
never moved by it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.pcd_header import PcdHeader, read_header
from mvreg.io.quiet import quiet_open3d
from mvreg.io.table import parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array


def read_pcd(path: Path) -> PointCloud:
    """Read the points (N, 3), NaN included, and the sensor's position where the header has it.

    Raises
    ------
    InputError
        With file, line or byte, and reason.
    """
    data = path.read_bytes()
    header = read_header(data, path)
    if header.points > len(data) and header.data != "binary_compressed":
        raise _truncated(path, f"{len(data)} bytes", header)
    kinds = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}
    return PointCloud(kinds[header.data](data, header, path), header.view_point)


def _ascii(data: bytes, header: PcdHeader, path: Path) -> Array:
    columns = sum(field.count for field in header.fields)
    parsed = parse_rows(data, header.size, header.points, columns)
    if parsed is not None:
        table = parsed[0]
    else:
        lines = data[header.size :].decode("latin-1").split("\n")
        table = parse_lines(enumerate(lines, header.lines + 1), columns, path, header.points)
    if len(table) < header.points:
        raise _truncated(path, f"{len(table)} lines", header)
    names = [f.name for f in header.fields for _ in range(f.count)]
    return table[:, [names.index(axis) for axis in "xyz"]]


def _binary(data: bytes, header: PcdHeader, path: Path) -> Array:
    if header.size + header.points * header.record > len(data):
        raise _truncated(path, f"{len(data) - header.size} bytes", header)
    table = np.frombuffer(data, header.dtype, header.points, header.size)
    return np.stack([table[axis].astype(np.float64) for axis in "xyz"], axis=1)


def _compressed(data: bytes, header: PcdHeader, path: Path) -> Array:
    sizes = np.frombuffer(data[header.size : header.size + 8], "<u4")
    expected = header.points * header.record
    if len(sizes) < 2 or header.size + 8 + int(sizes[0]) > len(data):
        raise _truncated(path, f"{len(data) - header.size} bytes", header)
    # LZF cannot shrink anything to less than a hundredth: no memory for a size that is made up.
    if int(sizes[1]) != expected or expected > 100 * int(sizes[0]):
        raise InputError(
            f"{path}: the header announces {expected} bytes of points, but the data are "
            f"{int(sizes[0])} bytes that hold {int(sizes[1])}; the file is damaged"
        )
    with quiet_open3d() as open3d:
        try:
            cloud = open3d.io.read_point_cloud(str(path), remove_nan_points=False)
        except Exception as error:  # C++ exceptions come through in several guises
            raise InputError(f"{path}: not a readable PCD file: {error}") from error
    points: Array = np.asarray(cloud.points, dtype=np.float64).copy()
    if len(points) != header.points:
        raise InputError(
            f"{path}: expected {header.points} points, Open3D found {len(points)}; "
            "is the file damaged?"
        )
    return points


def _truncated(path: Path, found: str, header: PcdHeader) -> InputError:
    return InputError(
        f"{path}: the header announces {header.points} points, but only {found} follow; "
        "the file is truncated"
    )
