"""Read the vertices of an STL file through Open3D."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.quiet import quiet_open3d
from mvreg.types import Array


def read_stl(path: Path) -> Array:
    """Read the distinct vertices (N, 3), single precision as the format has it.

    Raises
    ------
    InputError
        Where Open3D finds nothing: it answers trouble with a warning and an empty mesh; and
        where the file is cut off, which Open3D passes over if it is between two triangles.
    """
    _check_end(path.read_bytes(), path)
    with quiet_open3d() as open3d:
        try:
            mesh = open3d.io.read_triangle_mesh(str(path))
        except Exception as error:  # C++ exceptions come through in several guises
            raise InputError(f"{path}: not a readable STL file: {error}") from error
    # A vertex is written once per triangle; as points they would count several times.
    vertices: Array = np.asarray(mesh.remove_duplicated_vertices().vertices, dtype=np.float64)
    if len(vertices) == 0:
        raise InputError(
            f"{path}: expected an STL file with triangles, found none; it is empty, truncated "
            "or of another format"
        )
    return vertices.copy()


def _check_end(data: bytes, path: Path) -> None:
    """A binary file states its size; a text ends with ``endsolid``."""
    stated = 84 + 50 * int.from_bytes(data[80:84], "little")
    if len(data) != stated and data[:5].lower() == b"solid" and b"endsolid" not in data.lower():
        raise InputError(
            f"{path}, byte {len(data)}: the file ends before 'endsolid'; it is truncated"
        )
