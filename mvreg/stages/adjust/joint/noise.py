"""The noise of a scan, told from how its points scatter about the surface through them.

Two numbers for every patch: the variance of the points that is noise, and what of their scatter is
no noise but relief that a patch of second order does not follow.
"""

from __future__ import annotations

import numpy as np

from mvreg.kernels.tree import Tree
from mvreg.types import Array, Indices

#: Groups of patches that are alike in incidence, and in range: of so many patches at least.
INCIDENCES, RANGES, FEWEST = 10, 3, 50
#: Ranges that differ by less than this factor are one.
SAME_RANGE = 1.5
#: The noise of a group is told by the smoothest fifth of it: relief makes the others rougher. Of
#: `figurine`'s gnome, a half says 2.0 times the variance that is there, a fifth 1.6 times.
SMOOTHEST, QUANTILE = 0.2, -0.8416
#: Scatter beyond so many times the noise is relief; over so many patches around it is averaged.
ROUGH, AROUND = 1.3, 6


def noise_variances(variances: Array, freedom: int, cosines: Array, ranges: Array) -> Array:
    """Variance (S,) of the points about the surface of each patch that is noise (length^2).

    Parameters
    ----------
    variances : (S,) array
        Of the points of each patch about it (length^2).
    freedom : int
        Degrees of freedom of each.
    cosines : (S,) array
        Of the incidence of the sensor's rays; all the same where nothing is known of them.
    ranges : (S,) array
        From the sensor (length), or anything that tells where noise is alike.

    Returns
    -------
    (S,) array
    """
    found = np.empty(len(variances))
    # The quantile of a chi-square over its degrees of freedom (Wilson and Hilferty 1931).
    part = 2 / (9 * max(freedom, 1))
    expected = (1 - part + QUANTILE * np.sqrt(part)) ** 3
    for band in _groups(np.arange(len(variances)), ranges, RANGES if _wide(ranges) else 1):
        for group in _groups(band, cosines, INCIDENCES):
            found[group] = np.quantile(variances[group], SMOOTHEST) / expected
    return found


def misfits(variances: Array, noise: Array, tree: Tree) -> Array:
    """Variance (S,) of the points of each patch that is relief rather than noise (length^2).

    `tree` is that of the patches: what is smooth by chance amid relief is not trusted.
    """
    count = min(AROUND, tree.n)
    if count < 1:
        return np.zeros(0)
    _, near = tree.query(tree.data, k=count)
    around = np.sqrt((variances[near.reshape(tree.n, count)] ** 2).mean(axis=1))
    found: Array = np.maximum(np.maximum(around, variances) - ROUGH * noise, 0.0)
    return found


def _wide(ranges: Array) -> bool:
    low, high = np.quantile(ranges, [0.1, 0.9]) if len(ranges) else (0.0, 0.0)
    return bool(high > SAME_RANGE * low)


def _groups(chosen: Indices, values: Array, count: int) -> list[Indices]:
    """Parts of `chosen`, those of like values together, and as many in each."""
    parts = max(1, min(count, len(chosen) // FEWEST))
    return np.array_split(chosen[np.argsort(values[chosen], kind="stable")], parts)
