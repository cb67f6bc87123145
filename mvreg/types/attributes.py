"""Scalars of each point besides its coordinates: colours, intensity, normals, times."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

import numpy as np

from mvreg.geometry.arrays import Array

#: Of any real type.
Values = np.ndarray[Any, Any]
#: Scalars (N,) of N points by name.
Attributes = Mapping[str, Values]

#: The names of colours and of normals, in order.
COLOURS = ("red", "green", "blue")
NORMALS = ("nx", "ny", "nz")
#: Attributes with these names are vectors in the frame of the points, and turn with them.
VECTORS: tuple[tuple[str, str, str], ...] = (NORMALS,)


class FullPoints(Protocol):
    """All points of a scan of which only some are held, read again from where they are kept."""

    @property
    def count(self) -> int:
        """How many there are."""

    @property
    def kinds(self) -> Mapping[str, np.dtype[Any]]:
        """The types of their attributes by name."""

    def __call__(self) -> tuple[Array, Attributes]:
        """Read points (N, 3), in the frame of the scan, and their attributes.

        Raises
        ------
        InputError
            If they are not there any more, or not the same.
        """

    def pieces(self) -> Iterator[tuple[Array, Attributes]]:
        """The same in order, some points at a time if they can be read so.

        Raises
        ------
        InputError
            As a call does; perhaps at the end.
        """


def turned(attributes: Attributes, rotation: Array) -> dict[str, Values]:
    """The same attributes in a frame turned by ``rotation`` (3, 3): normals turn, others stay."""
    found = dict(attributes)
    for names in VECTORS:
        if set(names) <= found.keys():
            vectors = np.stack([found[name] for name in names], axis=1) @ rotation.T
            for name, column in zip(names, vectors.T, strict=True):
                found[name] = column.astype(np.result_type(found[name].dtype, np.float32))
    return found
