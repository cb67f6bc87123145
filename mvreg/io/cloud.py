"""What one file holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.types import Array
from mvreg.types.attributes import Values


@dataclass(frozen=True, eq=False)
class PointCloud:
    """The points of one scan, as a file has them, and whatever else it says of them.

    Parameters
    ----------
    points : (N, 3) float64 array
        In the unit and the frame of the file. Readers may leave NaN in it.
    view_point : (3,) float64 array, optional
        The sensor's position, in the same unit and frame; None where the file does not say.
    attributes : mapping of str to (N,) array
        Scalars of each point by name, of any real type. The names are those of PLY where it has
        one: ``red``, ``green``, ``blue`` (``uint8`` or ``uint16``), ``intensity``, ``nx``, ``ny``,
        ``nz``; of others those of the file.
    name : str
        Of the scan within the file, where the file holds several or names its only one.
    T_world_scan : (4, 4) float64 array, optional
        The pose that the file gives, from the frame of `points` to that of the file's world.
    levelled : bool
        The file says that +z of `points` is against gravity.
    triangles : (M, 3) integer array, optional
        Of a mesh: indices into `points`.
    remarks : tuple of str
        What the reader left out or changed, in words: "1,204 points without a return left out".
    """

    points: Array
    view_point: Array | None = None
    attributes: Mapping[str, Values] = field(default_factory=dict)
    name: str = ""
    T_world_scan: Array | None = None
    levelled: bool = False
    triangles: Values | None = None
    remarks: tuple[str, ...] = ()

    def chosen(self, which: Values) -> PointCloud:
        """The points that a mask (N,) or indices (M,) choose, with their attributes.

        A mesh becomes a cloud: its triangles go.
        """
        return replace(
            self,
            points=np.ascontiguousarray(self.points[which]),
            attributes={name: values[which] for name, values in self.attributes.items()},
            triangles=None,
        )


def stacked(values: dict[str, Values]) -> Array:
    """Take x, y and z out of the values of points: an array (N, 3) of doubles."""
    return np.stack([values.pop(axis).astype(np.float64) for axis in "xyz"], axis=1)
