"""Comparisons for tests of stages: bit for bit, or up to rounding."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from mvreg.geometry import se3
from mvreg.testing.words import close, equal, expect, same_array
from mvreg.types import Array, Indices


def digest(value: Any) -> str:
    """A text that is the same for two values only if they are equal to the last bit.

    Records, mappings, sequences and arrays are walked through; random generators count as nothing,
    because drawing from them is allowed.
    """
    found = hashlib.sha256()
    for part in parts(value):
        found.update(part)
    return found.hexdigest()


def parts(value: Any) -> Iterator[bytes]:
    """The bytes that make up a value."""
    if isinstance(value, np.random.Generator) or (callable(value) and not is_dataclass(value)):
        return
    if isinstance(value, np.ndarray):
        yield f"{value.dtype}{value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif is_dataclass(value):
        yield type(value).__qualname__.encode()
        for field in fields(value):
            yield field.name.encode()
            yield from parts(getattr(value, field.name))
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield repr(key).encode()
            yield from parts(item)
    elif isinstance(value, list | tuple):
        yield f"{type(value).__name__}{len(value)}".encode()
        for item in value:
            yield from parts(item)
    else:
        yield repr(value).encode()


def locked(value: Any) -> Any:
    """The same value, its arrays made read-only: writing to them raises ValueError."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
    elif is_dataclass(value):
        for field in fields(value):
            locked(getattr(value, field.name))
    elif isinstance(value, list | tuple):
        for item in value:
            locked(item)
    elif isinstance(value, Mapping):
        locked(list(value.values()))
    return value


@contextmanager
def case(name: str) -> Iterator[None]:
    """Say in which case a check failed."""
    try:
        yield
    except Exception as error:
        error.add_note(f"in the case: {name}")
        raise


def assert_finite(**arrays: Any) -> None:
    """No NaN, no infinity."""
    for name, array in arrays.items():
        count = np.size(array) - int(np.isfinite(array).sum())
        expect(not count, f"finite {name}", f"{count} of {np.size(array)} NaN or infinite")


def assert_unit(vectors: Array) -> None:
    """Vectors (..., 3) of length 1."""
    assert_finite(vectors=vectors)
    equal("vectors of so many components", vectors.shape[-1], 3)
    lengths = np.linalg.norm(vectors, axis=-1)
    close("unit vectors: lengths", lengths, np.ones_like(lengths), atol=1e-9)


def assert_rigid(transform: Array) -> None:
    """A proper rigid motion (4, 4), float64."""
    equal("a pose of shape", transform.shape, (4, 4))
    equal("a pose of dtype", transform.dtype, np.dtype(np.float64))
    assert_finite(pose=transform)
    rotation = transform[:3, :3]
    close("a rigid motion: R R^T the identity", rotation @ rotation.T, np.eye(3), atol=1e-9)
    expect(np.linalg.det(rotation) > 0, "a rotation", "a reflection, of determinant -1")
    same_array("a pose whose last row is 0, 0, 0, 1", transform[3], np.array([0, 0, 0, 1.0]))


def assert_indices(indices: Indices, source: int, target: int) -> None:
    """Index pairs (M, 2) into `source` and `target` rows."""
    expect(indices.shape == (len(indices), 2), "index pairs of shape (M, 2)", indices.shape)
    whole = np.issubdtype(indices.dtype, np.integer)
    expect(whole, "index pairs of whole numbers", indices.dtype)
    inside = (indices >= 0).all() and (indices < [source, target]).all()
    expect(inside, f"positions below {source} and {target}, 0 or more", "others")


def apart(first: Array, second: Array, points: Array) -> float:
    """How far apart two poses (4, 4) put points (N, 3), at most (length)."""
    gaps = se3.apply(first, points) - se3.apply(second, points)
    return float(np.linalg.norm(gaps, axis=1).max())


def sorted_rows(rows: Array) -> Array:
    """Rows (N, C) in an order that depends only on their values, to 9 decimals."""
    order = np.lexsort(np.round(rows, 9).T[::-1])
    found: Array = rows[order]
    return found
