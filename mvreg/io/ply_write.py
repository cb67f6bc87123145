"""Write points as binary PLY, at once or piece by piece."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.cloud_stream import ROWS, numbered, replaced, rows_of
from mvreg.types import Array

#: PLY's names for NumPy's types; it has none for 64-bit integers and for booleans.
KINDS = {"f8": "double", "f4": "float", "i4": "int", "u4": "uint", "i2": "short", "u2": "ushort",
         "i1": "char", "u1": "uchar"}  # fmt: skip


def write_ply(path: str | Path, points: Array, normals: Array | None = None) -> None:
    """Write points, little endian, atomically: the file is there whole or not at all.

    Coordinates are written as doubles, so that what is read back is the same bit for bit;
    normals as floats.

    Parameters
    ----------
    path : str or Path
        Missing folders are made; an existing file is replaced.
    points : (N, 3) array
        In any unit; N may be 0, though `read_points` will refuse the file.
    normals : (N, 3) array, optional
        Unit vectors.

    Raises
    ------
    InputError
        If the shapes are wrong or the file cannot be written.
    """
    path = Path(path)
    points = _checked(points, "points", path)
    values: dict[str, Array] = {}
    if normals is not None:
        normals = _checked(normals, "normals", path)
        if len(normals) != len(points):
            raise InputError(f"{path}: expected {len(points)} normals, got {len(normals)}")
        values = dict(zip(("nx", "ny", "nz"), normals.astype(np.float32).T, strict=True))
    write_ply_clouds(
        path,
        [PointCloud(points, attributes=values)],
        {name: column.dtype for name, column in values.items()},
    )


def write_ply_clouds(
    path: str | Path, clouds: Iterable[PointCloud], kinds: Mapping[str, np.dtype[Any]]
) -> int:
    """Write clouds into one file, one after the other, as `write_ply` does.

    Only one cloud need be in memory at a time.

    Parameters
    ----------
    path : str or Path
        Missing folders are made; an existing file is replaced.
    clouds : iterable of PointCloud
        Of whose attributes those in `kinds` are written. A cloud that lacks one gets NaN, or 0
        where the type is whole.
    kinds : mapping of str to dtype
        The attributes and the types that they are written in: PLY has no 64-bit integers, which
        become doubles.

    Returns
    -------
    int
        How many points were written.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = Path(path)
    words = property_names(kinds)
    record = np.dtype([
        *((axis, "<f8") for axis in "xyz"),
        *((word, f"<{_code(kinds[name])}") for name, word in words.items()),
    ])  # fmt: skip
    count = 0
    with replaced(path) as part, part.open("w+b") as stream:
        stream.write(_header(record, 0))
        for cloud in clouds:
            for first in range(0, len(cloud.points), ROWS):
                rows_of(cloud, slice(first, first + ROWS), record, words).tofile(stream)
            count += len(cloud.points)
        stream.flush()
        stream.seek(0)
        stream.write(_header(record, count))
    return count


def _code(kind: np.dtype[Any]) -> str:
    code = f"{kind.kind}{kind.itemsize}".replace("b1", "u1").replace("f2", "f4")
    return code if code in KINDS else "f8"


def _checked(array: Array, what: str, path: Path) -> Array:
    array = np.asarray(array, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{path}: expected {what} (N, 3), got {array.shape}")
    return array


def property_names(names: Iterable[str]) -> dict[str, str]:
    """Words of ASCII for the names of attributes, none twice and none a coordinate's."""
    found: dict[str, str] = {}
    for name in names:
        word = re.sub(r"[^A-Za-z0-9_.:\[\]-]+", "_", name).strip("_") or "scalar"
        found[name] = numbered(word, {"x", "y", "z", *found.values()})
    return found


def _header(record: np.dtype[Any], count: int) -> bytes:
    """The header, of one length whatever the count: a comment fills it up."""
    properties = [f"property {KINDS[record[word].str[1:]]} {word}" for word in record.names or ()]
    room = " " * (15 - len(str(count)))
    lines = ["ply", "format binary_little_endian 1.0", f"comment written by mvreg{room}",
             f"element vertex {count}", *properties, "end_header", ""]  # fmt: skip
    return "\n".join(lines).encode("ascii")
