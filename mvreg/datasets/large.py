"""Large scans: some of the points are held for registration, all are read again for the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.errors import InputError
from mvreg.io import PointCloud
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
    their order stay; the same ones each time.

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
    rng = np.random.default_rng([count, most])
    chosen = np.sort(rng.choice(count, most, replace=False, shuffle=False))
    kinds = {name: values.dtype for name, values in cloud.attributes.items()}
    stored = StoredPoints(path, read, count, kinds, stamp_of(path))
    return PointCloud(cloud.points[chosen], cloud.view_point), stored
