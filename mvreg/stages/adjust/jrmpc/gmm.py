"""A mixture of isotropic Gaussians that several clouds share, and the steps of EM for it.

After Evangelidis, Kounades-Bastian, Horaud and Psarakis, "A generative model for the joint
registration of multiple point sets", ECCV 2014, and Evangelidis and Horaud, TPAMI 2018.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import WORKERS, build_tree, mean_spacing, neighbours_of
from mvreg.types import Array, Indices

#: A point answers for this many components, the nearest: farther ones have next to no share.
NEAREST = 4
#: Components that answer for less than this share of one point stay as they are.
NOTHING = 1e-9


@dataclass(frozen=True, eq=False)
class Mixture:
    """Gaussians of equal weight, and a uniform density for outliers.

    `means` (K, 3) and `variances` (K,), isotropic, in length and length^2; `weight` is each
    Gaussian's prior, `outliers` the prior times the density of the uniform part (1 / length^3).
    """

    means: Array
    variances: Array
    weight: float
    outliers: float

    def densities(self, points: Array, chosen: Indices) -> Array:
        """Prior times density (N, C) of the `chosen` (N, C) components at `points` (N, 3)."""
        variances = self.variances[chosen]
        squares = ((points[:, None] - self.means[chosen]) ** 2).sum(axis=2)
        density: Array = np.exp(-squares / (2 * variances)) / (2 * np.pi * variances) ** 1.5
        return self.weight * density


@dataclass(frozen=True, eq=False)
class Shares:
    """Responsibilities: the `chosen` (N, C) components of each point, and their posteriors (N, C).

    A row's rest is the outliers'; `likelihood` is the log of the points' density.
    """

    chosen: Indices
    posterior: Array
    likelihood: float


def thinned(points: Array, gap: float) -> Array:
    """The points (N, 3) that are at least `gap` (length) from all those kept before them.

    Greedy in the order given; the same in any frame.
    """
    from scipy.spatial import cKDTree

    near = cKDTree(points).query_ball_point(points, gap, workers=WORKERS)
    free, kept = np.ones(len(points), dtype=bool), []
    for index, neighbours in enumerate(near):
        if free[index]:
            kept.append(index)
            free[neighbours] = False
    return points[kept]


def begin(points: Array, gap: float, outlier_ratio: float) -> Mixture:
    """A mixture with a mean at every point that `thinned` keeps, as wide as they are apart.

    `gap` is their distance (length); `outlier_ratio` the paper's gamma: the uniform part's prior,
    over that of all Gaussians; it fills the smallest ball about the mean that holds all points.
    """
    means = thinned(points, gap)
    radius = max(float(np.linalg.norm(points - points.mean(axis=0), axis=1).max()), gap)
    spread = max(mean_spacing(means), gap)
    share, volume = 1 / (1 + outlier_ratio), 4 / 3 * np.pi * radius**3
    return Mixture(
        means, np.full(len(means), spread**2), share / len(means), outlier_ratio * share / volume
    )


def expect(mixture: Mixture, points: Array, before: Shares | None) -> Shares:
    """The E step, over each point's nearest components.

    A point keeps the components that it had `before` where they explain it better than the nearest
    do now: that way the likelihood, cut short as it is, never falls.
    """
    count = min(NEAREST, len(mixture.means))
    _, chosen = neighbours_of(build_tree(mixture.means), points, count)
    parts = mixture.densities(points, chosen)
    if before is not None:
        old = mixture.densities(points, before.chosen)
        better = old.sum(axis=1) > parts.sum(axis=1)
        chosen[better], parts[better] = before.chosen[better], old[better]
    total = parts.sum(axis=1) + mixture.outliers
    return Shares(chosen, parts / total[:, None], float(np.log(total).sum()))


def place(mixture: Mixture, shares: Shares, clouds: Sequence[Array], poses: Array) -> Array:
    """The M step of the poses (M, 4, 4): each cloud (N_m, 3) onto the means, by weighted Kabsch.

    A point's pulls, posterior over variance, add up to one towards their weighted mean.
    """
    pulls = shares.posterior / mixture.variances[shares.chosen]
    weights = pulls.sum(axis=1)
    towards = (pulls[..., None] * mixture.means[shares.chosen]).sum(axis=1)
    some = weights > 0
    towards[some] /= weights[some, None]
    new, ends = poses.copy(), np.cumsum([len(cloud) for cloud in clouds])[:-1]
    split = zip(clouds, np.split(towards, ends), np.split(weights, ends), strict=True)
    for index, (cloud, target, weight) in enumerate(split):
        if weight.any():
            new[index] = se3.fit(cloud, target, weight)
    return new


def maximise(mixture: Mixture, shares: Shares, points: Array, least: float) -> Mixture:
    """The M step of means and then variances, none below `least` (length^2)."""
    size, rows = len(mixture.means), shares.chosen.ravel()

    def summed(values: Array) -> Array:
        return np.bincount(rows, (shares.posterior * values).ravel(), size).astype(np.float64)

    mass = summed(np.ones((len(points), 1)))
    used = mass > NOTHING
    means, variances = mixture.means.copy(), mixture.variances.copy()
    sums = np.stack([summed(points[:, axis, None]) for axis in range(3)], axis=1)
    means[used] = sums[used] / mass[used, None]
    squares = summed(((points[:, None] - means[shares.chosen]) ** 2).sum(axis=2))
    variances[used] = np.maximum(squares[used] / (3 * mass[used]), least)
    return replace(mixture, means=means, variances=variances)
