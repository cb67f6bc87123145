"""Points and attributes out of columns with names, and out of arrays of colours and normals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mvreg.errors import few
from mvreg.types.attributes import COLOURS, NORMALS, Values
from mvreg.types.colours import as_bytes
from mvreg.types.colours import colours as whole_colours
from mvreg.types.column_names import (
    WHOLE_COLOURS,
    WHOLE_NORMALS,
    attribute_names,
    coordinates_named,
    with_usual_names,
)


class ForeignError(Exception):
    """What is wrong with something that should hold points, in words."""


def from_columns(columns: Mapping[Any, Any]) -> tuple[Values, dict[str, Values]]:
    """Coordinates (N, 3) and attributes of columns, by the names that files have for them, too.

    The coordinates are three columns, or one array with them.

    Raises
    ------
    ForeignError
        Where there are none; lists the columns.
    """
    names, keys = [str(key) for key in columns], list(columns)
    whole = {name for name, key in zip(names, keys, strict=True) if np.ndim(columns[key]) > 1}
    where = coordinates_named(names, whole)
    if isinstance(where, str):
        used = [names.index(where)]
        points = np.asarray(columns[keys[used[0]]])
    elif where is not None:
        used = [*where]
        points = _stacked([_numbers(columns[keys[at]]) for at in used], "xyz")
    elif len(keys) == 3 and all(name.isdecimal() for name in names):
        return _stacked([_numbers(column) for column in columns.values()], "xyz"), {}
    else:
        raise ForeignError(
            f"expected columns x, y and z, found {few(names)}; rename "
            "them, or pass the three as an array (N, 3)"
        )
    others = [at for at in range(len(keys)) if at not in used]
    found: dict[str, Values] = {}
    for at, usual in zip(others, attribute_names([names[at] for at in others]), strict=True):
        name, values = names[at].strip().lower(), np.asarray(columns[keys[at]])
        if values.ndim == 1 and values.dtype.kind in "biuf":
            found[usual] = values
        elif name in WHOLE_COLOURS:
            found |= colours(values)
        elif name in WHOLE_NORMALS:
            found |= normals(values)
    return points, _one_colour(with_usual_names(found))


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
