"""Write points as binary PLY."""

from __future__ import annotations

from pathlib import Path
from uuid import uuid4

import numpy as np

from mvreg.errors import InputError
from mvreg.types import Array


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
    fields = [(axis, "<f8") for axis in "xyz"]
    if normals is not None:
        normals = _checked(normals, "normals", path)
        if len(normals) != len(points):
            raise InputError(f"{path}: expected {len(points)} normals, got {len(normals)}")
        fields += [(axis, "<f4") for axis in ("nx", "ny", "nz")]
    table = np.empty(len(points), dtype=fields)
    columns = points if normals is None else np.hstack([points, normals])
    for (name, _), column in zip(fields, columns.T, strict=True):
        table[name] = column
    _replace(path, _header(fields, len(points)) + table.tobytes())


def _checked(array: Array, what: str, path: Path) -> Array:
    array = np.asarray(array, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{path}: expected {what} (N, 3), got {array.shape}")
    return array


def _header(fields: list[tuple[str, str]], count: int) -> bytes:
    kinds = {"<f8": "double", "<f4": "float"}
    properties = [f"property {kinds[kind]} {name}" for name, kind in fields]
    lines = ["ply", "format binary_little_endian 1.0", "comment written by mvreg",
             f"element vertex {count}", *properties, "end_header", ""]  # fmt: skip
    return "\n".join(lines).encode("ascii")


def _replace(path: Path, content: bytes) -> None:
    part = path.with_name(f".{path.name}.{uuid4().hex[:8]}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(content)
        part.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
