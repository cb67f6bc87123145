"""Names of attributes: one for what writers call differently."""

from __future__ import annotations

from mvreg.io.cloud import PointCloud, stacked
from mvreg.types.attributes import COLOURS, NORMALS, Values
from mvreg.types.column_names import with_usual_names

#: What most writers call these, in small letters.
USUAL = ("x", "y", "z", *NORMALS, *COLOURS, "alpha", "intensity")


def cloud_of(values: dict[str, Values]) -> PointCloud:
    """The points and attributes that the columns of a file amount to; takes x, y and z out."""
    points = stacked(values)
    return PointCloud(points, attributes=with_usual_names(values))
