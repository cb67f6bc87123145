"""What a record asks of its fields, once, when it is made.

A few microseconds each: a run makes thousands of records. Arrays are taken as they are where they
are float64, and converted where that loses nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np

from mvreg.errors import RecordError
from mvreg.geometry.arrays import Array, Indices

#: How far ``R^T R`` may be from the identity, and a normal's squared length from 1: rotations in
#: single precision pass, scaled and sheared ones do not.
RIGID = 1e-6
FLOAT = np.dtype(np.float64)
LARGEST = float(np.finfo(FLOAT).max)
all_of, least_of = np.logical_and.reduce, np.minimum.reduce  # as `all` and `min`, but quicker


def keep(record: Any, **values: Any) -> None:
    """Set fields of a frozen record, where its `__post_init__` has converted them."""
    for name, value in values.items():
        if getattr(record, name) is not value:
            object.__setattr__(record, name, value)


def floats(name: str, values: Any, *shape: int | str) -> Array:
    """Values as a finite float64 array of a shape; in `shape` a letter is any length.

    Raises
    ------
    RecordError
        For what is no array of real numbers, another shape, NaN and infinities.
    """
    array: Array = values
    if type(values) is not np.ndarray or values.dtype != FLOAT:
        array = converted(name, values, "fiu", FLOAT)
    check_shape(name, array, shape)
    if not all_of(np.isfinite(array), axis=None):
        at = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
        raise RecordError(f"{name}: expected finite numbers, got {array[at]} at {at}")
    return array


def integers(name: str, values: Any, *shape: int | str) -> Indices:
    """Positions in another array, as an array of a shape: whole numbers, none negative.

    Raises
    ------
    RecordError
        For what is no array of whole numbers, another shape, and negative ones.
    """
    array: Indices = values
    if type(values) is not np.ndarray or values.dtype.kind not in "iu":
        array = converted(name, values, "iu", np.dtype(np.intp))
    check_shape(name, array, shape)
    if array.size and least_of(array, axis=None) < 0:
        raise RecordError(f"{name}: expected positions, 0 or more, got {array.min()}")
    return array


def converted(name: str, values: Any, kinds: str, dtype: np.dtype[Any]) -> Any:
    """Values as an array of a dtype, if they are of a kind that fits it; no values always do."""
    wanted = "whole numbers" if "f" not in kinds else "real numbers"
    try:
        array = np.asarray(values)
    except ValueError:  # ragged
        raise RecordError(f"{name}: expected an array of {wanted}, got {shown(values)}") from None
    if array.size and array.dtype.kind not in kinds:
        raise RecordError(f"{name}: expected an array of {wanted}, got {shown(values)}")
    return array.astype(dtype)


def check_shape(name: str, array: Any, shape: tuple[int | str, ...]) -> None:
    """Raise RecordError for another shape; a letter in `shape` is any length."""
    got = array.shape
    fits = len(got) == len(shape)
    for want, length in zip(shape, got, strict=False):
        fits = fits and (want == length or type(want) is str)
    if fits:
        return
    raise RecordError(f"{name}: expected shape ({', '.join(map(str, shape))}), got {got}")


def pose(name: str, values: Any) -> Array:
    """A rigid motion (4, 4): finite, a proper rotation to 1e-6, and the last row (0, 0, 0, 1).

    Whatever the unit of length: nothing is asked of the translation but that it is finite.

    Raises
    ------
    RecordError
        For anything else; says by how much.
    """
    array: Array = values
    if type(values) is not np.ndarray or values.dtype != FLOAT or values.shape != (4, 4):
        array = floats(name, values, 4, 4)
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = array.tolist()  # faster than NumPy on 16
    error = (
        abs(a * a + d * d + g * g - 1) + abs(b * b + e * e + h * h - 1)
        + abs(c * c + f * f + i * i - 1) + abs(a * b + d * e + g * h)
        + abs(a * c + d * f + g * i) + abs(b * c + e * f + h * i)
    )  # fmt: skip
    if not (error <= RIGID and isfinite(x + y + z)):  # NaN is neither more nor less
        floats(name, array, 4, 4)
    if error > RIGID:
        raise RecordError(
            f"{name}: expected a rigid motion, got a matrix whose R^T R is {error:.2g} from the "
            "identity; mvreg.geometry.se3.project gives the nearest rigid motion"
        )
    if a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0:
        raise RecordError(f"{name}: expected a rotation, got a reflection (determinant -1)")
    if last != [0.0, 0.0, 0.0, 1.0]:
        raise RecordError(f"{name}: expected the last row (0, 0, 0, 1), got {tuple(last)}")
    return array


def poses(name: str, values: Any) -> Array:
    """Rigid motions (C, 4, 4), each as `pose` wants it."""
    if type(values) is np.ndarray and values.shape == (0, 4, 4):
        return values
    array = floats(name, values, "C", 4, 4)
    for index, one in enumerate(array):
        pose(f"{name}[{index}]", one)
    return array


def named_poses(name: str, values: Any) -> Mapping[str, Array]:
    """A mapping of scans' names to rigid motions (4, 4); itself where none had to be converted."""
    if not isinstance(values, Mapping):
        raise RecordError(f"{name}: expected a mapping of names to poses, got {shown(values)}")
    made = {key: pose(f"{name}[{key!r}]", one) for key, one in values.items()}
    for key in made:
        text(f"a key of {name}", key)
    return values if all(made[key] is values[key] for key in made) else made


def unit(name: str, values: Any, *shape: int | str) -> Array:
    """Unit vectors along the last axis, as an array of a shape."""
    array = floats(name, values, *shape)
    squares = np.einsum("...i,...i->...", array, array)
    if squares.size and (squares.max() > 1 + 2 * RIGID or squares.min() < 1 - 2 * RIGID):
        at = np.unravel_index(np.abs(squares - 1).argmax(), squares.shape)
        where, length = tuple(map(int, at)), float(np.sqrt(squares[at]))
        raise RecordError(f"{name}: expected unit vectors, got one of length {length:g} at {where}")
    return array


def number(name: str, value: Any, least: float = -np.inf, most: float = np.inf) -> None:
    """Raise RecordError for what is no real number within bounds, which may be infinite."""
    try:
        fits = bool(least <= value <= most)  # NaN is not
    except (TypeError, ValueError):
        fits = False
    if not fits:
        bounds = "a number" if least == -np.inf else f"a number in [{least:g}, {most:g}]"
        raise RecordError(f"{name}: expected {bounds}, got {shown(value)}")


def length(name: str, value: Any) -> None:
    """Raise RecordError for what is no finite number, 0 or more."""
    number(name, value, 0.0, LARGEST)


def text(name: str, value: Any) -> None:
    """Raise RecordError for what is no text; it may be empty, names mean nothing."""
    if not isinstance(value, str):
        raise RecordError(f"{name}: expected a text, got {shown(value)}")


def truth(name: str, value: Any) -> bool:
    """A truth value, NumPy's made Python's."""
    if not isinstance(value, bool | np.bool_):
        raise RecordError(f"{name}: expected True or False, got {shown(value)}")
    return bool(value)


def instance(name: str, value: Any, cls: type) -> None:
    """Raise RecordError for what is no instance of a class."""
    if not isinstance(value, cls):
        raise RecordError(f"{name}: expected {cls.__name__}, got {shown(value)}")


def shown(value: Any) -> str:
    """A value as messages show it: its type, and the shape or the text of what is short."""
    if isinstance(value, np.ndarray):
        return f"an array {value.shape} of {value.dtype}"
    if value is None or isinstance(value, bool):
        return str(value)
    words = repr(value)
    kind = type(value).__name__
    return f"{kind} {words}" if len(words) <= 60 and "\n" not in words else f"a {kind}"
