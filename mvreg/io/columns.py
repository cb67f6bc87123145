"""What a table says of its points besides x, y and z, or holds instead of points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.types import Array
from mvreg.types.attributes import COLOURS, NORMALS, Values
from mvreg.types.colours import as_bytes
from mvreg.types.colours import colours as whole_colours
from mvreg.types.column_names import QUATERNION, attribute_names

#: Rotations are orthonormal to so much, as files of few decimals have them.
_UNIT = 1e-3


def attributes_of(
    table: Array, axes: Sequence[int], names: Sequence[str] | None, skip: frozenset[int]
) -> dict[str, Values]:
    """The other columns (N,) by name; those that hold no number are left out.

    Parameters
    ----------
    table : (N, columns) array
    axes : sequence of int
        The columns of x, y and z.
    names : sequence of str, optional
        Of all columns; without names three columns behind x, y and z are colours or normals
        if they look so.
    skip : frozenset of int
        Columns that are not wanted.
    """
    columns = table.shape[1]
    called = attribute_names(names) if names else _guessed(table, axes)
    found: dict[str, Values] = {}
    for column in range(columns):
        if column in axes or column in skip or np.isnan(table[:, column]).all():
            continue
        found[called[column]] = np.ascontiguousarray(table[:, column])
    if set(COLOURS) <= set(found):
        found |= colours([found[name] for name in COLOURS])
    return found


def telling_rows(table: Array) -> Array:
    """Some rows of a table, of which `attributes_of` makes out what it would of all of them.

    Of each column one row that is least, largest, no whole number, and NaN; and that whose last
    three of six columns are the least like a unit vector.
    """
    rows: list[int] = []
    for values in table.T:
        lost = np.isnan(values)
        broken = ~lost & (values != np.floor(values))
        rows += [int(mask.argmax()) for mask in (lost, broken) if mask.any()]
        if not lost.all():
            rows += [int(np.nanargmin(values)), int(np.nanargmax(values))]
    if table.shape[1] == 6 and len(table):
        lengths = np.linalg.norm(table[:, 3:], axis=1)
        rows.append(int(np.where(lengths > 0, np.abs(lengths - 1), -1.0).argmax()))
    return table[sorted(set(rows))]


def _guessed(table: Array, axes: Sequence[int]) -> list[str]:
    """Names for columns without any: the likeliest colours, and numbers for the others."""
    names = [f"column_{column + 1}" for column in range(table.shape[1])]
    if tuple(axes) != (0, 1, 2) or not len(table):
        return names
    if table.shape[1] == 7 and (table[:, 6] == 255).all() and _like_colours(table[:, 3:6]):
        return [*names[:3], *COLOURS, "alpha"]  # as trimesh writes them
    # As PTS has it, a brightness stands before the colours.
    for first in {6: (3,), 7: (4, 3)}.get(table.shape[1], ()):
        if _like_colours(table[:, first : first + 3]):
            names[first : first + 3] = COLOURS
            if first == 4:
                names[3] = "intensity"
            return names
    if table.shape[1] == 6 and _like_normals(table[:, 3:]):
        names[3:] = NORMALS
    return names


def _like_colours(values: Array) -> bool:
    """Whether three columns are whole numbers of a byte, and not normals or flags."""
    low, high = values.min(), values.max()
    return bool(low >= 0 and 1 < high <= 255 and (values == np.floor(values)).all())


def _like_normals(values: Array) -> bool:
    """Whether three columns are unit vectors; zeros are where no normal is known."""
    lengths = np.linalg.norm(values, axis=1)
    known = lengths > 0
    return bool(known.any() and (np.abs(lengths[known] - 1) < 10 * _UNIT).all())


def colours(channels: Sequence[Values]) -> dict[str, Values]:
    """Colours as PLY has them, where they are numbers of a byte, of two, or shares of one."""
    table = np.stack([channel.astype(np.float64) for channel in channels], axis=1)
    whole = bool((table == np.floor(table)).all())
    return whole_colours(table if whole else as_bytes(table)) if table.size else {}


def poses_in(table: Array, names: Sequence[str] | None) -> str | None:
    """What a table holds if that is poses, in words; None for points."""
    rows, columns = table.shape
    if names and {name.lower().strip() for name in names} >= QUATERNION:
        return "poses with quaternions"
    if columns in (7, 8) and rows and _is_unit(np.linalg.norm(table[:, -4:], axis=1)):
        return "poses with quaternions"
    if (rows, columns) in ((3, 4), (4, 4)) and _is_rotation(table[:3, :3]):
        return "a pose, a matrix of 4 x 4"
    if columns in (12, 16) and rows and all(_is_rotation(r[:, :3]) for r in _matrices(table)):
        return "poses, a matrix in each row"
    return None


def _matrices(table: Array) -> Array:
    return table[:, :12].reshape(-1, 3, 4)


def _is_unit(values: Array) -> bool:
    return bool((np.abs(values - 1) < _UNIT).all())


def _is_rotation(matrix: Array) -> bool:
    return bool(np.abs(matrix @ matrix.T - np.eye(3)).max() < _UNIT)


def counters(table: Array, columns: Sequence[int]) -> str | None:
    """Why the first two of `columns` hardly are coordinates, in words; None if they may be.

    Counters are told only where at least three more columns are no whole numbers, and times where
    one more is there.
    """
    if len(table) < 10:
        return None
    spare = table.shape[1] - len(columns)
    first, second = table[:, columns[0]], table[:, columns[1]]
    broken = sum(not _whole(table[:, column]) for column in range(table.shape[1]))
    if _whole(first) and _sorted(first) and broken >= 3:
        if _whole(second):
            return f"columns {columns[0] + 1} and {columns[1] + 1} count as rows and columns do"
        return f"column {columns[0] + 1} counts the rows"
    steps = np.diff(first)
    if spare and steps.min() > 0 and np.ptp(steps) < 0.02 * steps.mean():
        return f"column {columns[0] + 1} grows evenly as a time does"
    return None


def _whole(values: Array) -> bool:
    return bool((values == np.floor(values)).all())


def _sorted(values: Array) -> bool:
    steps = np.diff(values)
    return bool((steps >= 0).all() and steps.max() <= 1 and steps.any())
