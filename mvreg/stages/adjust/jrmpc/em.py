"""EM for a mixture that several clouds share, and for their poses; see `mixture`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.adjust.jrmpc.gmm import Mixture, begin, expect, maximise, place
from mvreg.types import Array

#: Least standard deviation of a component, in component spacings: narrower ones fit single points.
LEAST_SPREAD = 0.1
#: Multiples of it, without their whole part, spread evenly over [0, 1).
GOLDEN = 0.6180339887498949


def register(
    clouds: Sequence[Array],
    poses: Array,
    gap: float,
    *,
    outlier_ratio: float,
    draws: int,
    iterations: int,
    still: float,
) -> tuple[Array, list[list[float]]]:
    """Fit a mixture to all the clouds, and the clouds to the mixture, in turn (ECM).

    The components are drawn anew several times: points that share a narrow component move with it,
    and hold each other where they are although the surfaces could still slide.

    Parameters
    ----------
    clouds, poses : sequence of (N_m, 3) arrays, (M, 4, 4) array
        Each cloud in a frame of its own, none empty; ``T_model_cloud`` to start from.
    gap, outlier_ratio
        See `begin`.
    draws, iterations : int
        How often components are drawn, and the iterations after each.
    still : float
        Stop when no point has moved farther since components were drawn (length).

    Returns
    -------
    poses : (M, 4, 4) array
        In a frame that may have moved a little: only their relation counts.
    likelihoods : list of lists of float
        What `climb` says after each draw.
    """
    likelihoods = []
    for draw in range(draws):
        before = stacked(clouds, poses)
        first = int(len(before) * (draw * GOLDEN % 1))  # another point is drawn first each time
        mixture = begin(np.roll(before, -first, axis=0), gap, outlier_ratio)
        poses, rising = climb(mixture, clouds, poses, (LEAST_SPREAD * gap) ** 2, iterations)
        likelihoods.append(rising)
        if np.linalg.norm(stacked(clouds, poses) - before, axis=1).max() <= still:
            break
    return poses, likelihoods


def stacked(clouds: Sequence[Array], poses: Array) -> Array:
    """All the clouds' points (N, 3) in the model frame."""
    return np.concatenate([se3.apply(p, c) for p, c in zip(poses, clouds, strict=True)])


def climb(
    mixture: Mixture, clouds: Sequence[Array], poses: Array, least: float, iterations: int
) -> tuple[Array, list[float]]:
    """Some iterations of EM: the poses, and the log-likelihood before each and at the end.

    It is that under the components that each point answers for, and never falls.
    """
    shares = expect(mixture, stacked(clouds, poses), None)
    likelihoods = [shares.likelihood]
    for _ in range(iterations):
        poses = place(mixture, shares, clouds, poses)
        points = stacked(clouds, poses)
        mixture = maximise(mixture, shares, points, least)
        shares = expect(mixture, points, shares)
        likelihoods.append(shares.likelihood)
    return poses, likelihoods
