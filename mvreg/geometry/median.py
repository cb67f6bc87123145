"""Medians of rows, without what `numpy.median` asks besides."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Array


def median(rows: Array) -> Array:
    """The median along the last axis, of even counts the mean of the middle two.

    As `numpy.median`, but for NaN, which must not be among them.

    Parameters
    ----------
    rows : (..., P) array
        P >= 1.
    """
    count = rows.shape[-1]
    half = count // 2
    if count % 2:
        found: Array = np.partition(rows, half, axis=-1)[..., half]
        return found
    sorted_there = np.partition(rows, (half - 1, half), axis=-1)
    middle: Array = (sorted_there[..., half - 1] + sorted_there[..., half]) / 2
    return middle
