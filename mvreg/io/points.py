"""Read one scan, whatever the format: its points, and what the file says of its sensor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.arrays import read_npy
from mvreg.io.cloud import PointCloud
from mvreg.io.obj import read_obj
from mvreg.io.pcd import read_pcd
from mvreg.io.ply import read_ply
from mvreg.io.stl import read_stl
from mvreg.io.text import read_text
from mvreg.types import Array

#: Lower-case suffix to reader. A reader returns raw points (N, 3), which may hold NaN; as a
#: `PointCloud` where the format can say more.
READERS: dict[str, Callable[[Path], Array | PointCloud]] = {
    ".ply": read_ply,
    ".pcd": read_pcd,
    ".obj": read_obj,
    ".stl": read_stl,
    ".xyz": read_text,
    ".txt": read_text,
    ".csv": read_text,
    ".pts": read_text,
    ".asc": read_text,
    ".npy": read_npy,
    ".npz": read_npy,
}

#: The suffixes that can be read, in lower case; upper case is fine too.
SUPPORTED: tuple[str, ...] = tuple(READERS)


def read_points(path: str | Path) -> Array:
    """Read the points of one file; its suffix says how. As `read_cloud`, the points alone.

    Returns
    -------
    (N, 3) float64 array
        Finite coordinates in the file's own unit, N >= 1, in the file's order.

    Raises
    ------
    InputError
        As `read_cloud`.
    """
    return read_cloud(path).points


def read_cloud(path: str | Path) -> PointCloud:
    """Read one file; its suffix says how.

    Points that are NaN or infinite are dropped: range scanners write them for "no return".

    Parameters
    ----------
    path : str or Path
        A file with one of the `SUPPORTED` suffixes, in any case.

    Returns
    -------
    PointCloud
        Finite points (N, 3) in the file's own unit, N >= 1, in the file's order; and the sensor's
        position in the same coordinates, where the file tells it: the VIEWPOINT of a PCD file,
        unless it is the default ``0 0 0 1 0 0 0``, which most writers write regardless.

    Raises
    ------
    InputError
        If the file is missing, damaged, of an unknown kind, or holds no finite point. Never an
        empty cloud. The message names the file, the line or byte where there is one, and why.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        suffix = repr(path.suffix) if path.suffix else "no suffix"
        raise InputError(f"{path}: expected a file ending in {', '.join(SUPPORTED)}; got {suffix}")
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: expected a file, found a folder or a device")
        found = reader(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (MemoryError, OverflowError) as error:
        raise InputError(f"{path}: asks for more memory than there is; is it damaged?") from error
    cloud = found if isinstance(found, PointCloud) else PointCloud(found)
    return replace(cloud, points=_finite(np.asarray(cloud.points, dtype=np.float64), path))


def _finite(points: Array, path: Path) -> Array:
    if len(points) == 0:
        raise InputError(f"{path}: expected at least one point, found none; leave this file out")
    finite = np.isfinite(points)
    if finite.all():
        return np.ascontiguousarray(points)
    good = finite.all(axis=1)
    if not good.any():
        raise InputError(
            f"{path}: expected coordinates, found only NaN or infinite ones in all "
            f"{len(points)} points; leave this file out"
        )
    return points[good]
