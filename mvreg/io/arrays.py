"""Read points from NumPy's own files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError, NoScanError
from mvreg.io.cloud import PointCloud
from mvreg.io.columns import attributes_of, colours, poses_in
from mvreg.types.attributes import NORMALS, Values
from mvreg.types.column_names import (
    WHOLE_COLOURS,
    WHOLE_NORMALS,
    attribute_names,
    coordinates_named,
    with_usual_names,
)

#: A table has no more columns than this; what has is an image.
_MOST_COLUMNS = 32


def read_npy(path: Path) -> PointCloud:
    """Read an array of points, or the arrays of NPZ that are points and what belongs to them.

    An array is (N, 3 or more), (3, N) for N above 3, or (H, W, 3 or more); or it has fields, which
    say which are x, y and z. Of several arrays the points are called so, or there are x, y and z;
    arrays with a number for each point become attributes.

    Raises
    ------
    NoScanError
        If it is a matrix of a pose or a camera.
    InputError
        With file and reason. Pickled objects are refused: they can run code.
    """
    try:
        arrays = _load(path)
    except (InputError, OSError, MemoryError):
        raise
    except Exception as error:  # zipfile, zlib, struct, pickle and NumPy raise as they please
        raise InputError(f"{path}: not a readable NumPy file: {error}") from error
    if isinstance(arrays, np.ndarray):
        return _from_array(arrays, path)
    return _from_arrays(arrays, path)


def _load(path: Path) -> Values | dict[str, Values]:
    with path.open("rb") as stream:
        content = np.load(stream, allow_pickle=False)
        if isinstance(content, np.ndarray):
            return content
        found = {name: np.asarray(content[name]) for name in content.files}
        return next(iter(found.values())) if len(found) == 1 else found


def _from_array(array: Values, path: Path) -> PointCloud:
    if array.dtype.names:
        return _from_arrays({name: array[name] for name in array.dtype.names}, path)
    if array.dtype.kind not in "iuf":
        raise InputError(f"{path}: expected real numbers, got dtype {array.dtype}")
    shape, remarks = array.shape, []
    if array.ndim == 3 and array.dtype.itemsize == 1:
        raise InputError(f"{path}: expected points, got an image {shape} of {array.dtype}")
    if array.ndim == 3 and shape[-1] >= 3:
        array = array.reshape(-1, shape[-1])
    elif array.ndim == 2 and _is_transposed(*shape):
        if shape[0] <= 4 and (what := poses_in(np.asarray(array, dtype=np.float64), None)):
            raise NoScanError(f"{path}: expected points, found {what}; leave this file out")
        array = array.T
        remarks = [f"read an array {shape} as {array.shape}, a point in each column"]
    if array.ndim != 2 or array.shape[1] < 3 or array.shape[1] > _MOST_COLUMNS:
        raise InputError(
            f"{path}: expected an array (N, 3), got {shape}; of a depth image save the points"
        )
    if shape == (3, 3):
        raise NoScanError(
            f"{path}: expected an array (N, 3) of many points, got (3, 3), which may be a matrix"
        )
    table = np.asarray(array, dtype=np.float64)
    if what := poses_in(table, None):
        raise NoScanError(f"{path}: expected points, found {what}; leave this file out")
    if array.dtype == np.float16:
        most = np.nanmax(np.abs(np.where(np.isfinite(table), table, 0.0)[:, :3]), initial=0.0)
        remarks.append(
            f"the coordinates are in half precision, steps of up to {np.spacing(np.float16(most))}"
        )
    return PointCloud(
        table[:, :3],
        attributes=attributes_of(table, (0, 1, 2), None, frozenset()),
        remarks=tuple(remarks),
    )


def _is_transposed(rows: int, columns: int) -> bool:
    """Whether a table has a point in each column: (3, N), or too many columns for attributes."""
    return (rows == 3 < columns) or (3 < rows <= 9 and columns > _MOST_COLUMNS)


def _from_arrays(arrays: Mapping[str, Values], path: Path) -> PointCloud:
    """From several arrays, or several fields of one."""
    names = list(arrays)
    where = coordinates_named(names, {name for name in names if arrays[name].ndim > 1})
    if isinstance(where, str):
        whole, used = arrays[where], {where}
    elif where is not None:
        used = {names[axis] for axis in where}
        whole = _stacked([arrays[names[axis]] for axis in where], path)
    else:
        tables = [name for name in names if arrays[name].ndim >= 2 and arrays[name].shape[-1] >= 3]
        if len(tables) != 1:
            raise InputError(
                f"{path}: expected one array, or one named 'points', or x, y and z; found {names}"
            )
        whole, used = arrays[tables[0]], set(tables)
    if whole.ndim == 1:
        raise InputError(f"{path}: expected an array (N, 3), got {whole.shape}")
    cloud = _from_array(whole, path)
    more: dict[str, Values] = {}
    others = [name for name in names if name not in used]
    for name, usual in zip(others, attribute_names(others), strict=True):
        more |= _attribute(name, usual, arrays[name], len(cloud.points))
    found = with_usual_names({**cloud.attributes, **more})
    return PointCloud(cloud.points, attributes=found, remarks=cloud.remarks)


def _stacked(axes: list[Values], path: Path) -> Values:
    if len({axis.shape for axis in axes}) > 1 or axes[0].dtype.kind not in "iuf":
        shapes = ", ".join(f"{axis.dtype} {axis.shape}" for axis in axes)
        raise InputError(f"{path}: expected x, y and z of one shape of real numbers, got {shapes}")
    return np.stack([axis.ravel() for axis in axes], axis=-1)


def _attribute(name: str, usual: str, values: Values, count: int) -> dict[str, Values]:
    """What an array says of each of `count` points; nothing if it is about something else.

    `usual` is what attributes of its name are called.
    """
    if values.dtype.kind not in "iufb":
        return {}
    lower = name.strip().lower()
    if values.size == count:
        known: Any = values.astype(np.uint8) if values.dtype.kind == "b" else values
        return {usual: known.ravel()}
    if lower in WHOLE_COLOURS and values.size >= 3 * count and values.shape[-1] in (3, 4):
        channels = values.reshape(-1, values.shape[-1]).T[:3]
        return colours(list(channels)) if len(channels[0]) == count else {}
    if lower in WHOLE_NORMALS and values.size == 3 * count and values.shape[-1] == 3:
        return dict(zip(NORMALS, np.ascontiguousarray(values.reshape(-1, 3).T), strict=True))
    return {}
