"""Large scans: some of the points are held for registration, all are read again for the model."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.datasets.sample import Sample, drawn
from mvreg.errors import InputError
from mvreg.io import NotInPiecesError, Pieces, PointCloud
from mvreg.types import Array
from mvreg.types.attributes import Attributes, Values

#: Points of a scan that are registered. `experiments/accuracy/thinning.py`: of scans of a million
#: points and more, poses from so many are as accurate as from all.
MOST_POINTS = 500_000


@dataclass(frozen=True, eq=False)
class StoredPoints:
    """All points of a scan, in the file that they were read from.

    Parameters
    ----------
    path : Path
    read : callable
        ``read()`` reads the scan again as it was read before.
    count : int
        The points that there were.
    kinds : mapping of str to dtype
        Their attributes.
    stamp : tuple of int
        Of the file as it was: size in bytes, time of the last change in ns.
    parts : callable, optional
        ``parts()`` reads it again piece by piece, with points that do not count.
    """

    path: Path
    read: Callable[[], PointCloud]
    count: int
    kinds: Mapping[str, np.dtype[Any]]
    stamp: tuple[int, int]
    parts: Callable[[], Iterator[PointCloud]] | None = None

    def __call__(self) -> tuple[Array, Attributes]:
        """Read points (N, 3), in the frame of the file, and their attributes.

        Raises
        ------
        InputError
            If the file has changed or gone.
        """
        self._check()
        cloud = self.read()
        if len(cloud.points) != self.count:
            raise self._changed()
        return cloud.points, cloud.attributes

    def pieces(self) -> Iterator[tuple[Array, Attributes]]:
        """The same, some points at a time if the file is read so.

        Raises
        ------
        InputError
            If the file has changed or gone; it may be noticed at the end.
        """
        if self.parts is None:
            yield self()
            return
        self._check()
        count = 0
        try:
            for cloud in self.parts():
                there, _ = counting(cloud.points)
                kept = cloud if there.all() else cloud.chosen(there)
                count += len(kept.points)
                yield kept.points, kept.attributes
        except NotInPiecesError as error:
            raise self._changed() from error
        if count != self.count:
            raise self._changed()

    def _check(self) -> None:
        try:
            if stamp_of(self.path) != self.stamp:
                raise self._changed()
        except OSError as error:
            raise InputError(
                f"{self.path}: cannot be read again for the model: {error.strerror or error}"
            ) from error

    def _changed(self) -> InputError:
        return InputError(f"{self.path}: the file has changed since the run began; run again")


def counting(points: Array) -> tuple[Values, int]:
    """Which points (N, 3) are finite and not at 0, 0, 0, and how many are there."""
    x, y, z = points.T
    zero = (x == 0) & (y == 0) & (z == 0)
    return np.isfinite(x) & np.isfinite(y) & np.isfinite(z) & ~zero, int(np.count_nonzero(zero))


def stamp_of(path: Path) -> tuple[int, int]:
    """Size in bytes and time of the last change in ns."""
    found = path.stat()
    return found.st_size, found.st_mtime_ns


def held(
    cloud: PointCloud, path: Path, read: Callable[[], PointCloud], most: int
) -> tuple[PointCloud, StoredPoints | None]:
    """What is held of a scan: all of it, or `most` of its points and the way to the others.

    The points are drawn at random, so that their density, which tells where the sensor was, and
    their order stay; the same ones each time, also if the file is read piece by piece.

    Parameters
    ----------
    cloud : PointCloud
    path : Path
        The file that it is from.
    read : callable
        Reads it again.
    most : int
        Points held at most; 0 for all.
    """
    count = len(cloud.points)
    if not most or count <= most:
        return cloud, None
    kinds = {name: values.dtype for name, values in cloud.attributes.items()}
    stored = StoredPoints(path, read, count, kinds, stamp_of(path))
    thin = replace(cloud, points=cloud.points[drawn(count, most)], attributes={}, triangles=None)
    return thin, stored


@dataclass(frozen=True, eq=False)
class Thinned:
    """What is held of a scan that was read piece by piece.

    Parameters
    ----------
    cloud : PointCloud
        Some of its points; what the file says besides.
    full : StoredPoints
        The way to all of them.
    dropped : int
        Points at exactly 0, 0, 0 that do not count, see `without_zeros`.
    """

    cloud: PointCloud
    full: StoredPoints
    dropped: int


def thinned(
    pieces: Pieces, path: Path, read: Callable[[], PointCloud], most: int
) -> Thinned | None:
    """As `held`, of a scan that is read piece by piece; None where it has to be read whole.

    That is where it has no more points than `most`, or a single one at 0, 0, 0.

    Raises
    ------
    NotInPiecesError, InputError
        If the file turns out to be odd or damaged.
    """
    stamp, sample, zeros = stamp_of(path), Sample(most), 0
    for cloud in pieces.clouds:
        there, more = counting(cloud.points)
        zeros += more
        sample.add(cloud.points[there])
    # A single point at 0, 0, 0 may be real, and has its place among the others.
    if sample.count <= most or zeros == 1:
        return None
    stored = StoredPoints(path, read, sample.count, pieces.kinds, stamp, pieces.again)
    cloud = PointCloud(
        sample.points(), pieces.view_point, name=pieces.name, T_world_scan=pieces.T_world_scan,
        remarks=tuple(pieces.remarks),
    )  # fmt: skip
    return Thinned(cloud, stored, zeros)
