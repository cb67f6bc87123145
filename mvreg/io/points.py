"""Read scans, whatever the format: points, attributes, and what the file says of the sensor."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io.cloud import PointCloud
from mvreg.io.compressed import with_compressed
from mvreg.io.formats import FORMATS, Format, ReadOptions, by_suffix, format_of
from mvreg.io.mesh_points import with_points_on_triangles
from mvreg.io.pieces import NotInPiecesError, Pieces, quietly, quietly_each
from mvreg.types import Array

#: The formats that come with mvreg by lower-case suffix.
READERS: dict[str, Format] = with_compressed(by_suffix(FORMATS))

#: The suffixes that can be read without a plugin, in lower case; upper case is fine too.
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
    """Read a file that holds one scan; its suffix says how.

    Parameters
    ----------
    path : str or Path
        A file with one of the `SUPPORTED` suffixes, in any case.

    Returns
    -------
    PointCloud
        As one of `read_clouds`.

    Raises
    ------
    InputError
        As `read_clouds`; and if the file holds several scans.
    """
    clouds = read_clouds(path)
    if len(clouds) > 1:
        raise InputError(f"{path}: expected one scan, found {len(clouds)}; use read_clouds")
    return clouds[0]


def read_clouds(
    path: str | Path,
    options: ReadOptions | None = None,
    formats: Mapping[str, Format] | None = None,
) -> tuple[PointCloud, ...]:
    """Read all scans of one file; its suffix says how. As `iterate_clouds`, all at once."""
    return tuple(iterate_clouds(path, options, formats))


def iterate_clouds(
    path: str | Path,
    options: ReadOptions | None = None,
    formats: Mapping[str, Format] | None = None,
) -> Generator[PointCloud, None, None]:
    """Read the scans of one file, one after the other; its suffix says how.

    Points that are NaN or infinite are dropped: range scanners write them for "no return". Where
    a mesh is too coarse for its vertices to show its surface, the points are spread over its
    triangles instead, and a remark says so: `mesh_points.with_points_on_triangles`.

    Parameters
    ----------
    path : str or Path
        A file with one of the suffixes of `formats`, in any case.
    options : ReadOptions, optional
        What the user says of the file.
    formats : mapping of str to Format, optional
        By suffix; those that come with mvreg if not given.

    Yields
    ------
    PointCloud
        At least one, each with finite points (N, 3) in the file's own unit, N >= 1, in the file's
        order. The sensor's position is in the same coordinates, where the file tells it: the
        VIEWPOINT of a PCD file, unless it is the default ``0 0 0 1 0 0 0``, which most writers
        write regardless.

    Raises
    ------
    InputError
        If the file is missing, damaged, of an unknown kind, or holds no finite point. Never an
        empty cloud. The message names the file, the line or byte where there is one, and why.
    """
    path = Path(path)
    known = READERS if formats is None else with_compressed(formats)
    reader = format_of(path, known).read
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: expected a file, found a folder or a device")
        nothing = True
        clouds = iter(quietly(reader, path, options or ReadOptions()))
        for cloud in quietly_each(clouds):
            nothing = False
            yield quietly(_finite, cloud, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (MemoryError, OverflowError) as error:
        raise InputError(f"{path}: asks for more memory than there is; is it damaged?") from error
    if nothing:
        raise InputError(f"{path}: expected at least one scan, found none; leave this file out")


def open_pieces(
    path: str | Path,
    options: ReadOptions | None = None,
    formats: Mapping[str, Format] | None = None,
) -> Iterator[Pieces]:
    """The scans of one file, each piece by piece; the next once the pieces of one are all read.

    As `iterate_clouds` would read them, but with points that are not finite.

    Raises
    ------
    NotInPiecesError
        If the file has to be read whole, which may turn out at its end; whatever error is met may
        come, too.
    """
    path = Path(path)
    known = READERS if formats is None else with_compressed(formats)
    opened = format_of(path, known).pieces
    if opened is None:
        raise NotInPiecesError
    scans = iter(quietly(opened, path, options or ReadOptions()))
    for pieces in quietly_each(scans):
        pieces.clouds = quietly_each(pieces.clouds)
        yield pieces


def whole_scan(pieces: Pieces, begun: bool = False) -> PointCloud:
    """All of a scan that comes in pieces, as one of `iterate_clouds`.

    Parameters
    ----------
    pieces : Pieces
    begun : bool
        Its pieces have been read before.

    Raises
    ------
    InputError
        As `iterate_clouds`.
    NotInPiecesError
        If the file has to be read whole.
    """
    found: PointCloud = quietly(
        _finite, pieces.whole_again() if begun else pieces.whole(), pieces.path
    )
    return found


def _finite(cloud: PointCloud, path: Path) -> PointCloud:
    cloud = replace(cloud, points=np.asarray(cloud.points, dtype=np.float64))
    cloud = with_points_on_triangles(cloud)
    if len(cloud.points) == 0:
        raise InputError(f"{path}: expected at least one point, found none; leave this file out")
    finite = np.isfinite(cloud.points)
    if finite.all():
        return replace(cloud, points=np.ascontiguousarray(cloud.points))
    good = np.asarray(finite.all(axis=1))
    if not good.any():
        raise InputError(
            f"{path}: expected coordinates, found only NaN or infinite ones in all "
            f"{len(cloud.points)} points; leave this file out"
        )
    return cloud.chosen(good)
