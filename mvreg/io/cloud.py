"""What one file holds."""

from __future__ import annotations

from dataclasses import dataclass

from mvreg.types import Array


@dataclass(frozen=True, eq=False)
class PointCloud:
    """The points of one file, and where its sensor was, if the file says so.

    Parameters
    ----------
    points : (N, 3) float64 array
        In the unit and the frame of the file.
    view_point : (3,) float64 array, optional
        The sensor's position, in the same unit and frame; None where the file does not say.
    """

    points: Array
    view_point: Array | None = None
