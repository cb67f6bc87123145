"""Points that are none: what some sensors write where nothing came back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.io import PointCloud


def without_zeros(cloud: PointCloud, path: Path) -> tuple[PointCloud, int]:
    """Drop the points at exactly 0, 0, 0 if there are several of them; a single one may be real.

    Parameters
    ----------
    cloud : PointCloud
        Of N points.
    path : Path
        The file that it is from, for the message.

    Returns
    -------
    cloud : PointCloud
        Of the others, M >= 1, in their order.
    dropped : int
        N - M.

    Raises
    ------
    InputError
        If there are no others.
    """
    zero = np.asarray(~cloud.points.any(axis=1))
    dropped = int(np.count_nonzero(zero))
    if dropped < 2:
        return cloud, 0
    if dropped == len(zero):
        raise InputError(
            f"{path}: expected coordinates, found 0, 0, 0 in all {dropped} points, which means "
            "that the sensor saw nothing; leave this file out"
        )
    return cloud.chosen(~zero), dropped


def remark_on_zeros(dropped: Mapping[str, int]) -> tuple[str, ...]:
    """What is said of the points dropped of each scan: one sentence, or nothing."""
    total = sum(dropped.values())
    if not total:
        return ()
    some = sum(count > 0 for count in dropped.values())
    return (
        f"dropped {total:,} points at exactly 0, 0, 0, where the sensor saw nothing, "
        f"from {some} of {len(dropped)} scans",
    )
