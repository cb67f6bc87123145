"""Read STL files: the distinct corners of their triangles, and the triangles.

Ours because Open3D 0.20 answers trouble with a warning and an empty mesh, and passes over a cut
between two triangles.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.table import parse_lines
from mvreg.kernels.text import parse_rows
from mvreg.types import Array

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
_VERTEX = re.compile(rb"^[ \t]*vertex[ \t]([^\n]*)", re.MULTILINE | re.IGNORECASE)


def read_stl(path: Path) -> PointCloud:
    """Read the triangles, single precision as the binary format has it.

    Raises
    ------
    InputError
        Where there are no triangles, and where the file is cut off or its count is wrong.
    """
    data = path.read_bytes()
    stated = 84 + 50 * int.from_bytes(data[80:84], "little")
    # Binary files may begin with "solid" as well; only their length tells.
    if data[:5].lower() == b"solid" and not (len(data) == stated and len(data) > 84):
        corners = _ascii(data, path)
    else:
        corners = _binary(data, stated, path)
    # A corner is written once per triangle; as points they would count several times.
    _, first, which = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # as they come in the file
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    points = corners[first[order]].astype(np.float64)
    return PointCloud(points, triangles=place[which.reshape(-1)].reshape(-1, 3))


def _binary(data: bytes, stated: int, path: Path) -> Array:
    if len(data) < 84:
        raise InputError(
            f"{path}: expected an STL file, 'solid' or at least 84 bytes; got {len(data)} bytes"
        )
    count = (stated - 84) // 50
    if count == 0:
        raise InputError(f"{path}: expected an STL file with triangles, found none")
    if stated > len(data):
        raise InputError(
            f"{path}, byte {len(data)}: expected an STL file of {count} triangles, found its end "
            f"after {(len(data) - 84) // 50}; it is truncated or of another format"
        )
    # A few stray bytes at the end are fine, whole records are triangles that would be lost.
    if len(data) - stated >= 50:
        raise InputError(
            f"{path}, byte {stated}: expected the end of the file after {count} triangles, got "
            f"{len(data) - stated} more bytes; the count is wrong"
        )
    corners: Array = np.frombuffer(data, _RECORD, count, 84)["corners"].reshape(-1, 3)
    return corners + 0.0  # -0 is 0


def _ascii(data: bytes, path: Path) -> Array:
    data = data if b"\n" in data else data.replace(b"\r", b"\n")
    if b"endsolid" not in data.lower():
        raise InputError(
            f"{path}, byte {len(data)}: the file ends before 'endsolid'; it is truncated"
        )
    rows = _VERTEX.findall(data)
    if not rows:
        raise InputError(f"{path}: expected an STL file with triangles, found none")
    parsed = parse_rows(b"\n".join(rows), 0, len(rows), 3)
    if parsed is None:
        lines = enumerate(data.decode("latin-1").split("\n"), 1)
        found = ((number, line.split()) for number, line in lines)
        table = parse_lines(
            ((number, " ".join(words[1:])) for number, words in found
             if words and words[0].lower() == "vertex"),
            3, path,
        )  # fmt: skip
    else:
        table = parsed[0]
    facets = len(re.findall(rb"^[ \t]*facet\b", data, re.MULTILINE | re.IGNORECASE))
    if len(table) != 3 * facets:
        raise InputError(
            f"{path}: expected 3 vertices for each of {facets} facets, found {len(table)}"
        )
    return table + 0.0
