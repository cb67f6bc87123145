"""Read a PCD file: ASCII, binary and compressed.

Ours because Open3D 0.20 completes a truncated file with zeros or with whatever was in memory, a
plausible wrong cloud; reads compressed coordinates of 8 bytes as zeros; and drops all fields but
the coordinates, normals and colours.

The header's VIEWPOINT is taken as PCL takes it where it orients normals: the pose of the sensor in
the coordinates that the points have, so that its translation is the sensor's position. Points are
never moved by it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.names import cloud_of
from mvreg.io.pcd_header import Field, PcdHeader, read_header
from mvreg.io.table import as_declared, parse_lines
from mvreg.kernels.lzf import decompress
from mvreg.kernels.text import parse_rows
from mvreg.types import Array
from mvreg.types.attributes import Values


def read_pcd(path: Path) -> PointCloud:
    """Read points, NaN included, fields of one value, and the sensor's position if it is told.

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
    values = kinds[header.data](data, header, path)
    return replace(cloud_of(values), view_point=header.view_point, remarks=remarks_on(header))


def remarks_on(header: PcdHeader) -> tuple[str, ...]:
    """What is said of fields that are left out."""
    lists = [f"{f.name} ({f.count} values)" for f in header.fields if f.count > 1 and f.name != "_"]
    return (f"fields left out: {', '.join(lists)}",) if lists else ()


def _ascii(data: bytes, header: PcdHeader, path: Path) -> dict[str, Values]:
    columns = sum(field.count for field in header.fields)
    parsed = parse_rows(data, header.size, header.points, columns)
    if parsed is not None:
        table, end = parsed
    else:
        lines = data[header.size :].decode("latin-1").split("\n")
        table = parse_lines(enumerate(lines, header.lines + 1), columns, path, header.points + 1)
        end = len(data)
    if len(table) < header.points:
        raise _truncated(path, f"{len(table)} lines", header)
    if len(table) > header.points or data[end:].strip(b" \t\r\n\0\x1a"):
        raise _more(path, "further lines", header)
    return columns_of(table, header)


def columns_of(table: Array, header: PcdHeader) -> dict[str, Values]:
    """The fields of one value, each (N,), from the numbers of lines."""
    names = [f.name for f in header.fields for _ in range(f.count)]
    return {f.name: _typed(table[:, names.index(f.name)], f) for f in header.scalars}


def _typed(column: Array, field: Field) -> Values:
    """A column as the type that the header has for it; coordinates as doubles.

    Packed colours are written as integers or as the float that has their bits.
    """
    if field.name in ("rgb", "rgba") and field.code[0] == "F":
        whole = (column == np.rint(column)) & (np.abs(column) >= 1)
        packed = column.astype(np.float32).view(np.uint32)
        return np.where(whole, np.abs(column), packed).astype(np.uint32)
    return column if field.name in ("x", "y", "z") else as_declared(column, np.dtype(field.numpy))


def _binary(data: bytes, header: PcdHeader, path: Path) -> dict[str, Values]:
    left = len(data) - header.size - header.points * header.record
    if left < 0:
        raise _truncated(path, f"{len(data) - header.size} bytes", header)
    if left >= header.record and data[-left:].strip(b"\0"):
        raise _more(path, f"{left} bytes", header)
    table = np.frombuffer(data, header.dtype, header.points, header.size)
    return {field.name: table[field.name].astype(field.numpy) for field in header.scalars}


def _compressed(data: bytes, header: PcdHeader, path: Path) -> dict[str, Values]:
    sizes = np.frombuffer(data[header.size : header.size + 8], "<u4")
    expected = header.points * header.record
    if len(sizes) < 2 or header.size + 8 + int(sizes[0]) > len(data):
        raise _truncated(path, f"{len(data) - header.size} bytes", header)
    packed = memoryview(data)[header.size + 8 : header.size + 8 + int(sizes[0])]
    if int(sizes[1]) != expected:
        raise InputError(
            f"{path}: the header announces {expected} bytes of points, but the data are "
            f"{int(sizes[0])} bytes that hold {int(sizes[1])}; the file is damaged"
        )
    # What would not shrink is stored as it is, by PCL.
    raw = packed if len(packed) == expected else decompress(packed, expected)
    if raw is None:
        raise InputError(
            f"{path}, byte {header.size + 8}: expected {expected} bytes compressed by LZF; the "
            "file is damaged"
        )
    # Field after field, each for all points.
    return {
        field.name: np.frombuffer(
            raw, field.numpy, header.points, header.offsets[field.name] * header.points
        ).copy()
        for field in header.scalars
    }


def _truncated(path: Path, found: str, header: PcdHeader) -> InputError:
    return InputError(
        f"{path}: the header announces {header.points} points, but only {found} follow; "
        "the file is truncated"
    )


def _more(path: Path, found: str, header: PcdHeader) -> InputError:
    return InputError(
        f"{path}: the header announces {header.points} points, but after them {found} follow; "
        "the header's count is wrong"
    )
