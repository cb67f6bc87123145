"""Points and attributes out of columns with names, and out of arrays of colours and normals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mvreg.errors import few
from mvreg.types.attributes import COLOURS, NORMALS, Values
from mvreg.types.colours import as_bytes
from mvreg.types.colours import colours as whole_colours

#: Other spellings of attributes, in small letters.
SPELLINGS = {
    "r": "red", "g": "green", "b": "blue", "normal_x": "nx", "normal_y": "ny", "normal_z": "nz",
    "intensities": "intensity",
}  # fmt: skip
#: Arrays of several numbers a point, in small letters.
POINTS = ("points", "positions", "xyz", "vertices")
MANY = {
    "colors": "colours", "colours": "colours", "color": "colours", "rgb": "colours",
    "normals": "normals", "normal": "normals",
}  # fmt: skip


class ForeignError(Exception):
    """What is wrong with something that should hold points, in words."""


def from_columns(columns: Mapping[Any, Any]) -> tuple[Values, dict[str, Values]]:
    """Coordinates (N, 3) of the columns x, y and z, or of one of `POINTS`; the others' attributes.

    Raises
    ------
    ForeignError
        Where there are none; lists the columns.
    """
    by_name = {str(key).strip().lower(): key for key in columns}
    if set("xyz") <= by_name.keys():
        keys = [by_name[axis] for axis in "xyz"]
        points = _stacked([_numbers(columns[key]) for key in keys], "xyz")
    elif key := next((by_name[name] for name in POINTS if name in by_name), None):
        keys, points = [key], np.asarray(columns[key])
    elif len(by_name) == 3 and all(str(key).isdecimal() for key in columns):
        return _stacked([_numbers(column) for column in columns.values()], "xyz"), {}
    else:
        raise ForeignError(
            f"expected columns x, y and z, found {few([str(key) for key in columns])}; rename "
            "them, or pass the three as an array (N, 3)"
        )
    found: dict[str, Values] = {}
    for key in columns:
        name = str(key).strip()
        known = MANY.get(name.lower())
        if key in keys:
            continue
        values = np.asarray(columns[key])
        if known == "colours":
            found |= colours(values)
        elif known == "normals":
            found |= normals(values)
        elif values.dtype.kind in "biuf" and values.ndim == 1:
            found[_spelled(name)] = values
    return points, _one_colour(found)


def _spelled(name: str) -> str:
    """The usual name of an attribute; of others their own."""
    small = name.lower()
    usual = SPELLINGS.get(small, small)
    return usual if usual in (*COLOURS, *NORMALS, "intensity") else name


def _stacked(columns: Iterable[Values], axes: str) -> Values:
    found = list(columns)
    if len({len(column) for column in found}) > 1:
        lengths = ", ".join(f"{a} {len(c)}" for a, c in zip(axes, found, strict=True))
        raise ForeignError(f"expected x, y and z of one length, got {lengths}")
    return np.stack(found, axis=1)


def _numbers(column: Any) -> Values:
    array = np.asarray(column)
    if array.ndim != 1:
        raise ForeignError(f"expected a number a point in a column, got an array {array.shape}")
    try:
        if array.dtype.kind not in "iufO":
            raise TypeError
        return array.astype(np.float64)
    except (TypeError, ValueError):
        raise ForeignError(
            f"expected coordinates that are real numbers, got a column of {array.dtype}"
        ) from None


def _one_colour(found: dict[str, Values]) -> dict[str, Values]:
    """The attributes, with colours in one of the two types that files have."""
    if not set(COLOURS) <= found.keys():
        return found
    return {**found, **colours(np.stack([found[name] for name in COLOURS], axis=1))}


def colours(values: Any) -> dict[str, Values]:
    """Colours (N, 3) or (N, 4) as red, green and blue, ``uint8`` or ``uint16``; none if neither.

    Real numbers up to 1 are shares of 255.
    """
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] < 3 or not len(array) or array.dtype.kind not in "iuf":
        return {}
    array = array[:, :3]
    if array.dtype in (np.uint8, np.uint16):
        return {name: array[:, i].copy() for i, name in enumerate(COLOURS)}
    if array.dtype.kind == "f":
        if not np.isfinite(array).all():
            return {}
        array = np.rint(as_bytes(array))
    return whole_colours(array)


def normals(values: Any) -> dict[str, Values]:
    """Normals (N, 3) as nx, ny and nz; none where they are not that."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind != "f":
        return {}
    return {name: array[:, i].copy() for i, name in enumerate(NORMALS)}
