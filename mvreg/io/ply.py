"""Read the vertices of a PLY file.

Ours because others fail on real scans: Stanford's carry ``obj_info`` lines and a ``range_grid``
of variable-length lists, copies of them stray words in the header, and some are big-endian.
Elements after the vertices are not read.
"""

from __future__ import annotations

from pathlib import Path

from mvreg.errors import InputError
from mvreg.io.ply_ascii import read_ascii
from mvreg.io.ply_binary import read_binary
from mvreg.io.ply_header import Header, read_header
from mvreg.types import Array


def read_ply(path: Path) -> Array:
    """Read the vertices (N, 3), NaN included.

    Raises
    ------
    InputError
        With file, line or byte, and reason.
    """
    data = path.read_bytes()
    header = read_header(data, path)
    _check_size(header, len(data) - header.size, path)
    if header.format == "ascii":
        return read_ascii(data, header, path)
    return read_binary(data, header, path)


def _check_size(header: Header, left: int, path: Path) -> None:
    """Refuse an absurd number of vertices before anything is allocated for it."""
    count = header.elements[header.vertex_index].count
    if count > left:
        raise InputError(
            f"{path}: the header announces {count} vertices, but only {left} bytes follow; "
            "the file is truncated or the number is wrong"
        )
