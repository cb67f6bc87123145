"""Points that are none: what some sensors write where nothing came back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mvreg.errors import InputError
from mvreg.types import Array


def without_zeros(points: Array, path: Path) -> tuple[Array, int]:
    """Drop the points at exactly 0, 0, 0 if there are several of them; a single one may be real.

    Parameters
    ----------
    points : (N, 3) array
    path : Path
        The file that they are from, for the message.

    Returns
    -------
    points : (M, 3) array
        The others, M >= 1, in their order.
    dropped : int
        N - M.

    Raises
    ------
    InputError
        If there are no others.
    """
    zero = ~points.any(axis=1)
    dropped = int(np.count_nonzero(zero))
    if dropped < 2:
        return points, 0
    if dropped == len(points):
        raise InputError(
            f"{path}: expected coordinates, found 0, 0, 0 in all {dropped} points, which means "
            "that the sensor saw nothing; leave this file out"
        )
    return points[~zero], dropped


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
