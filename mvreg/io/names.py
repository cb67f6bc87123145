"""Names of attributes: one for what writers call differently."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mvreg.io.cloud import PointCloud, stacked
from mvreg.types.attributes import COLOURS, NORMALS, Values

#: What most writers call these, in small letters.
USUAL = ("x", "y", "z", *NORMALS, *COLOURS, "alpha", "intensity")
#: Triples of names, and those that they stand for: of MeshLab's and PCL's files, and of tables.
TRIPLES: dict[tuple[str, str, str], tuple[str, str, str]] = {
    ("diffuse_red", "diffuse_green", "diffuse_blue"): COLOURS,
    ("r", "g", "b"): COLOURS,
    ("normal_x", "normal_y", "normal_z"): NORMALS,
}


def with_usual_names(values: Mapping[str, Values]) -> dict[str, Values]:
    """The same attributes under the names that `PointCloud` has for them.

    Colours that PCL packs into one number, ``rgb`` or ``rgba``, are unpacked. What has a usual
    name already keeps it, and nothing is lost to a second one of that name.
    """
    found = dict(values)
    for others, usual in TRIPLES.items():
        if set(others) <= found.keys() and not set(usual) & found.keys():
            found = {
                dict(zip(others, usual, strict=True)).get(name, name): column
                for name, column in found.items()
            }
    for packed in ("rgb", "rgba"):
        if packed in found and found[packed].dtype.itemsize == 4 and not set(COLOURS) & set(found):
            bits = np.ascontiguousarray(found.pop(packed)).view(np.uint32)
            for name, shift in zip(COLOURS, (16, 8, 0), strict=True):
                found[name] = (bits >> shift & 255).astype(np.uint8)
            if packed == "rgba":
                found["alpha"] = (bits >> 24).astype(np.uint8)
    return found


def cloud_of(values: dict[str, Values]) -> PointCloud:
    """The points and attributes that the columns of a file amount to; takes x, y and z out."""
    points = stacked(values)
    return PointCloud(points, attributes=with_usual_names(values))
