"""Large scans: some of the points are held for registration, all are read again for the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.datasets.sample import Sample, drawn
from mvreg.errors import InputError
from mvreg.io import NotInPiecesError, Pieces, PointCloud
from mvreg.types import Array
from mvreg.types.attributes import Attributes

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
    """

    path: Path
    read: Callable[[], PointCloud]
    count: int
    kinds: Mapping[str, np.dtype[Any]]
    stamp: tuple[int, int]

    def __call__(self) -> tuple[Array, Attributes]:
        """Read points (N, 3), in the frame of the file, and their attributes.

        Raises
        ------
        InputError
            If the file has changed or gone.
        """
        changed = f"{self.path}: the file has changed since the run began; run again"
        try:
            if stamp_of(self.path) != self.stamp:
                raise InputError(changed)
        except OSError as error:
            raise InputError(
                f"{self.path}: cannot be read again for the model: {error.strerror or error}"
            ) from error
        cloud = self.read()
        if len(cloud.points) != self.count:
            raise InputError(changed)
        return cloud.points, cloud.attributes


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
    return PointCloud(cloud.points[drawn(count, most)], cloud.view_point), stored


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
    """As `held`, of a file that is read piece by piece; None where it has to be read whole.

    That is where it has no more points than `most`, or turns out to be odd or damaged.
    """
    if not 0 < most < pieces.count:
        return None
    stamp, sample, zeros = stamp_of(path), Sample(most), 0
    try:
        for points in pieces.points:
            x, y, z = points.T
            finite = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
            zero = (x == 0) & (y == 0) & (z == 0)
            zeros += int(np.count_nonzero(zero))
            sample.add(points[finite & ~zero])
    except (InputError, NotInPiecesError):
        return None
    # A single point at 0, 0, 0 may be real, and has its place among the others.
    if sample.count <= most or zeros == 1:
        return None
    stored = StoredPoints(path, read, sample.count, pieces.kinds, stamp)
    cloud = PointCloud(sample.points(), pieces.view_point, remarks=tuple(pieces.remarks))
    return Thinned(cloud, stored, zeros)
