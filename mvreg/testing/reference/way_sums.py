"""Reference of the sums over contacts: from rows, all of them at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.geometry.arrays import Array, Indices
from mvreg.testing.reference import joint
from mvreg.testing.reference.joint import Patches


def normal_equations(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    ends: Indices,
    samples: Indices,
    patches: Indices,
    begin: Indices,
    cells: Array,
    fits: Array,
    centre: Array,
    radius: float,
    flat: bool,
    width: float,
) -> tuple[Array, Array]:
    """The weighted sums ``J^T W J`` and ``J^T W r`` over each way's contacts."""
    size = len(samples)
    made = np.empty(size), np.empty((size, 6)), np.empty((size, 3)), np.empty(size)
    joint.rows(surfaces, motions, ways, ends, samples, patches, centre, radius, flat, *made)
    residuals, jacobian, _, aside = made
    sources, targets = np.repeat(begin[ways], np.diff(ends), axis=0).T
    known, fit = cells[sources + samples], fits[targets + patches]
    units = (4 - 8 * aside + 18 * aside**2) * fit[:, 1] + known[:, 1] + fit[:, 2]
    units = np.sqrt(units) / radius
    weights = known[:, 0] * fit[:, 0] * units**2
    return joint.normal_equations(
        jacobian / units[:, None], residuals / units, weights, ends, width
    )  # fmt: skip


def known_at(
    ways: Indices, ends: Indices, samples: Indices, patches: Indices, begin: Indices,
    precisions: Array,
) -> Array:  # fmt: skip
    """What all the patches know that a sample lies on, its own share included."""
    sources, targets = np.repeat(begin[ways], np.diff(ends), axis=0).T
    found: Array = precisions[:, 0] + np.bincount(
        sources + samples, precisions[targets + patches, 1], len(precisions)
    )
    return found
