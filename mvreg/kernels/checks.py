"""What a compiled kernel asks of its arguments, once, at its entry.

Kernels index without bounds checks: a position or a shape that is wrong would read outside an
array. These checks convert what can be converted without loss (a copy where dtype or layout
differ; read-only arrays are taken as they are) and refuse the rest. In shapes, a letter stands
for any length of an axis.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from mvreg.errors import InputError, RecordError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mvreg.geometry.arrays import Array, Indices, Places

FLOAT = np.dtype(np.float64)


def floats(name: str, values: Any, *shape: int | str, finite: bool = False) -> Array:
    """Values as a C-contiguous float64 array of a shape.

    Raises
    ------
    RecordError
        For another shape, for complex numbers, and for NaN or infinities where `finite` is asked.
    """
    # The common case first: small calls are many.
    if type(values) is not np.ndarray or values.dtype != FLOAT:
        if np.iscomplexobj(values):
            raise RecordError(f"{name}: expected real numbers, got complex ones")
        values = np.asarray(values, dtype=FLOAT)
    array: Array = np.ascontiguousarray(values)
    _check_shape(name, array, shape)
    if finite and not np.isfinite(array).all():
        wrong = tuple(np.argwhere(~np.isfinite(array))[0].tolist())
        raise RecordError(f"{name}: expected finite numbers, got {array[wrong]} at {wrong}")
    return array


def integers(name: str, values: Any, *shape: int | str) -> Indices:
    """Integers as a C-contiguous intp array of a shape; an empty array may have any dtype.

    Raises
    ------
    RecordError
        For another shape, and for what is no integer.
    """
    given = np.asarray(values)
    if given.size and given.dtype.kind not in "iub":
        raise RecordError(f"{name}: expected integers, got {given.dtype}")
    array: Indices = np.ascontiguousarray(given, dtype=np.intp)
    _check_shape(name, array, shape)
    return array


def places(name: str, values: Any, *shape: int | str) -> Places:
    """`integers` as C's int.

    Raises
    ------
    RecordError
        As `integers` does, and for numbers that C's int does not hold.
    """
    if type(values) is np.ndarray and values.dtype == np.intc:
        array: Places = np.ascontiguousarray(values)
        _check_shape(name, array, shape)
        return array
    limits = np.iinfo(np.intc)
    wide = integers(name, values, *shape)
    if wide.size and (wide.min() < limits.min or wide.max() > limits.max):
        raise RecordError(f"{name}: expected {limits.bits} bits a number, got {wide.max()}")
    return wide.astype(np.intc)


def indices(name: str, values: Any, size: int, *shape: int | str) -> Indices:
    """`integers`, all of them in [0, size).

    Raises
    ------
    RecordError
        As `integers` does, and for an index out of range.
    """
    array = integers(name, values, *shape)
    if array.size and (array.min() < 0 or array.max() >= size):
        wrong = array[(array < 0) | (array >= size)].flat[0]
        raise RecordError(f"{name}: expected positions among {size}, got {wrong}")
    return array


def flags(name: str, values: Any, *shape: int | str) -> NDArray[np.uint8]:
    """Truth values as a C-contiguous array of a shape, one byte each.

    Raises
    ------
    RecordError
        For another shape.
    """
    array = np.ascontiguousarray(values, dtype=bool)
    _check_shape(name, array, shape)
    return array.view(np.uint8)


def index_pairs(name: str, values: Any, source: int, target: int) -> Indices:
    """Positions (M, 2): the first column's in [0, source), the second one's in [0, target).

    Raises
    ------
    RecordError
        As `indices` does.
    """
    pairs = integers(name, values, "M", 2)
    if len(pairs) and (pairs.min() < 0 or (pairs.max(axis=0) >= (source, target)).any()):
        for column, size in enumerate((source, target)):
            indices(f"{name}[:, {column}]", pairs[:, column], size, "M")
    return pairs


def ends(name: str, values: Any, size: int) -> Indices:
    """Where each of S parts begins and the last one ends: (S + 1,), ascending within [0, size].

    Raises
    ------
    RecordError
        As `integers` does, and where they descend or leave the range.
    """
    array = integers(name, values, "S + 1")
    if not len(array):
        raise RecordError(f"{name}: expected one number more than there are parts, got none")
    if array[0] < 0 or array[-1] > size or (array[1:] < array[:-1]).any():
        raise RecordError(f"{name}: expected ends that ascend from 0 to {size}, got {array}")
    return array


def transform(name: str, values: Any, *, finite: bool = False) -> Array:
    """A motion (4, 4) as a C-contiguous float64 array.

    Raises
    ------
    RecordError
        For another shape, and for NaN or infinities where `finite` is asked.
    """
    array = floats(name, values, finite=finite)
    if array.shape != (4, 4):
        raise RecordError(f"{name}: expected a motion (4, 4), got {array.shape}")
    return array


def positive(**values: float) -> None:
    """Raise InputError for the first number that is not positive and finite."""
    for name, value in values.items():
        if not 0 < value < np.inf:
            raise InputError(f"{name}: expected a positive, finite number, got {value}")


def _check_shape(name: str, array: NDArray[Any], shape: tuple[int | str, ...]) -> None:
    """Raise RecordError for another shape than this; none stands for any."""
    if not shape or array.shape == shape:
        return
    fits = array.ndim == len(shape)
    if fits:
        for want, got in zip(shape, array.shape, strict=True):
            fits = fits and (want == got or type(want) is str)
    if not fits:
        wanted = ", ".join(map(str, shape))
        raise RecordError(f"{name}: expected shape ({wanted}), got {array.shape}")
