"""Whatever looks like points: arrays, tables, tensors, clouds and meshes of other libraries.

None of these libraries is imported. An object is known by the package that its class is from, or
by the protocols that arrays share: NumPy's, the buffer of Python, DLPack.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mvreg.errors import InputError
from mvreg.geometry.arrays import Array
from mvreg.types.attributes import Values
from mvreg.types.checks import shown
from mvreg.types.foreign import READERS, ForeignError
from mvreg.types.named_columns import from_columns

EXPECTED = (
    "expected points as an array (N, 3) of numbers, or what holds such: a table with columns x, y "
    "and z, a tensor, a point cloud or mesh of Open3D or trimesh"
)


class HasPoints(Protocol):
    """A cloud of another library, as Open3D's."""

    @property
    def points(self) -> Any:
        """Coordinates (N, 3)."""


class HasPoint(Protocol):
    """A cloud of Open3D's tensors."""

    @property
    def point(self) -> Any:
        """Tensors by name: positions (N, 3)."""


class HasVertices(Protocol):
    """A mesh of another library, or a cloud of trimesh."""

    @property
    def vertices(self) -> Any:
        """Coordinates (N, 3)."""


class HasDLPack(Protocol):
    """A tensor in the memory of this computer."""

    def __dlpack__(self, *, stream: Any = None) -> Any:
        """What another library makes an array of."""


#: What points may come as: see `points_of`.
PointLike = (
    ArrayLike | Mapping[str, ArrayLike] | HasPoints | HasPoint | HasVertices | HasDLPack
)  # fmt: skip


def points_of(name: str, value: object) -> tuple[Array, dict[str, Values]]:
    """Coordinates (N, 3), in an array of their own, and the attributes that come with them.

    Parameters
    ----------
    name : str
        The scan's, for messages.
    value : object
        An array (N, 3), or (H, W, 3), of real numbers of any type, order and strides, or anything
        that becomes one: lists of lists, what has ``__array__``, ``__array_interface__``,
        ``__dlpack__``, a tensor of torch on any device. An array with fields, a data frame or a
        mapping with columns x, y and z, called as in files (``X[mm]``, ``Easting``); its other
        columns of numbers become attributes, by the names that they get of files. A point
        cloud or a triangle mesh of Open3D, old or of tensors, or of trimesh: of a mesh the
        vertices, or points on its triangles where they are coarse, as with files. Colours,
        normals and intensities are kept under the names that `Scan` has for them.

    Raises
    ------
    InputError
        Says what was expected, what came, and what to do.
    """
    try:
        found, attributes = _read(value)
        points = _numbers(found)
    except ForeignError as error:
        raise InputError(f"scan {name!r}: {error}") from None
    if points.ndim == 3 and points.shape[2] == 3:
        points = points.reshape(-1, 3)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(
            f"scan {name!r}: expected points (N, 3), got {points.shape}{_advice(points.shape)}"
        )
    return points, {key: v for key, v in attributes.items() if v.shape == (len(points),)}


def _read(value: Any) -> tuple[Any, dict[str, Values]]:
    """What holds the coordinates, and the attributes."""
    if type(value) is np.ndarray and value.dtype.names is None:
        return value, {}
    packages = {cls.__module__.partition(".")[0] for cls in type(value).__mro__}
    for package, reader in READERS.items():
        if package in packages:
            return reader(value)
    if isinstance(value, np.ndarray) and value.dtype.names is not None:
        return from_columns({name: value[name] for name in value.dtype.names})
    if isinstance(value, Mapping):
        return from_columns(value)
    if isinstance(value, str | bytes) or value is None:
        raise ForeignError(f"{EXPECTED}; got {shown(value)}")
    return _by_protocol(value), {}


def _by_protocol(value: Any) -> Any:
    """An array, made of what says that it is one."""
    if isinstance(value, np.ndarray):
        return value
    numpys = any(hasattr(value, name) for name in ("__array__", "__array_interface__"))
    try:
        if numpys or isinstance(value, Sequence):
            return np.asarray(value)
        if hasattr(value, "__dlpack__"):
            return np.from_dlpack(value)
        return np.asarray(memoryview(value))
    except Exception as error:  # other people's code, which raises as it pleases
        raise ForeignError(_why_not(value, error)) from None


def _why_not(value: Any, error: Exception) -> str:
    """Why no array could be made of something."""
    if isinstance(value, Sequence) and not isinstance(value, memoryview):
        ragged = "inhomogeneous" in str(error)
        why = "rows of different lengths" if ragged else f"{type(error).__name__}: {error}"
        return f"{EXPECTED}; got a {type(value).__name__} with {why}"
    known = any(hasattr(value, n) for n in ("__array__", "__array_interface__", "__dlpack__"))
    if known:
        text = " ".join(str(error).split())
        return (
            f"expected an array in this computer's memory, got a {_kind(value)} of which NumPy "
            f"cannot make one ({type(error).__name__}: {text}); copy it there first"
        )
    hint = "; make a list of it" if hasattr(value, "__iter__") else ""
    return f"{EXPECTED}; got {shown(value)}{hint}"


def _kind(value: Any) -> str:
    cls = type(value)
    return f"{cls.__module__.partition('.')[0]} {cls.__qualname__}"


def _numbers(found: Any) -> Array:
    """A new array of doubles in C order."""
    if isinstance(found, np.ma.MaskedArray) and np.ma.is_masked(found):
        count = int(np.ma.getmaskarray(found).sum())
        raise ForeignError(
            f"expected points without a mask, got {count:,} masked numbers; drop those "
            "points: array.data[~np.ma.getmaskarray(array).any(axis=1)]"
        )
    try:
        array = np.asarray(found)
        if array.dtype.kind not in "iufO" and array.size:
            raise ForeignError(f"expected real numbers, got an array of {array.dtype}")
        return np.array(array, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        if isinstance(found, Sequence):
            raise ForeignError(_why_not(found, error)) from None
        raise ForeignError(f"{EXPECTED}; got {shown(found)}: {error}") from None


def _advice(shape: tuple[int, ...]) -> str:
    """What to do about an array of another shape."""
    if len(shape) == 2 and shape[0] == 3 and shape[1] > 3:
        return "; a point is a row: pass array.T"
    if len(shape) == 2 and shape[1] > 3:
        return (
            "; pass array[:, :3], and what the other columns hold as "
            "mvreg.Scan(name, points, attributes={'intensity': array[:, 3]})"
        )
    if len(shape) == 1 and shape[0] and shape[0] % 3 == 0:
        return "; if these are x, y, z, x, y, z, ...: pass array.reshape(-1, 3)"
    if len(shape) == 2 and shape[1] == 2:
        return "; mvreg registers points in space, not in a plane"
    return ""
