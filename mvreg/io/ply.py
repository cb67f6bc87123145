"""Read the vertices of a PLY file.

Ours because others fail on real scans: Stanford's carry ``obj_info`` lines and a ``range_grid``
of variable-length lists, copies of them stray words in the header, and some are big-endian.
Elements after the vertices are not read.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.names import cloud_of
from mvreg.io.ply_ascii import read_ascii
from mvreg.io.ply_binary import read_binary
from mvreg.io.ply_faces import read_triangles
from mvreg.io.ply_header import Header, read_header


def read_ply(path: Path) -> PointCloud:
    """Read the vertices, NaN included, with every scalar property, and the triangles if any.

    Raises
    ------
    InputError
        With file, line or byte, and reason.
    """
    data = path.read_bytes()
    header = read_header(data, path)
    _check_size(header, len(data) - header.size, path)
    read = read_ascii if header.format == "ascii" else read_binary
    values = read(data, header, path)
    return replace(cloud_of(values), triangles=read_triangles(data, header))


def _check_size(header: Header, left: int, path: Path) -> None:
    """Refuse an absurd number of vertices before anything is allocated for it."""
    count = header.elements[header.vertex_index].count
    if count > left:
        raise InputError(
            f"{path}: the header announces {count} vertices, but only {left} bytes follow; "
            "the file is truncated or the number is wrong"
        )
