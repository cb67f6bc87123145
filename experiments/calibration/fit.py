"""Fit the probability of `mvreg.evidence` to poses known to be right or wrong.

A logistic regression with a ridge on few features, each of which may only count one way: more
overlap never speaks against a pose, more violation never for it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvreg.types import Array

Flags = NDArray[np.bool_]

#: Which way each feature may count, in the order of `mvreg.evidence.calibration.FEATURES`.
SIGNS = (1, -1, -1, 1, -1, -1)
#: No piece of evidence counts less than this: what right and wrong poses of these sets happen not
#: to differ in, others may.
LEAST = (0.5, 0.5, 0.5, 0.25, 0.5, 0.5)
#: Strength of the ridge, half of it times the squared weights is added to the mean log loss. Right
#: and wrong are all but separable, so that without one the probabilities would be 0 and 1.
RIDGE = 0.002
#: The share of right poses that each kind counts as having: that of the best poses of attempts,
#: which are what the judge is asked about; of all poses weighed here, 0.04 are right.
RIGHT = 0.4


#: Groups of one kind of scene and sensor; the others' kind is their name up to a dash.
KINDS = {
    "armadillo_virtual": "armadillo", "rgbd_desk": "desk", "lidar_campus": "street",
    "tls_office": "office",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Sample:
    """Poses of one group: `features` (P, F), which are `right` (P,), and the group's `kind`."""

    features: Array
    right: Flags
    kind: str = ""


def fit(samples: Sequence[Sample], centre: Array, without: Sequence[int] = ()) -> Array:
    """Intercept and weights (1 + F,) that make right poses of all samples probable.

    Every kind counts the same, with `RIGHT` of right poses; within it every sample does, however
    many poses it has.

    Parameters
    ----------
    samples : sequence of Sample
    centre : (F,) array
        Subtracted from the features.
    without : sequence of int
        Positions of features that must not count.
    """
    from scipy.optimize import minimize

    features = np.concatenate([sample.features for sample in samples]) - centre
    right = np.concatenate([sample.right for sample in samples])
    sign = np.where(right, 1.0, -1.0)
    weight = weights_of(samples)
    design = np.hstack([np.ones((len(features), 1)), features])

    def loss(weights: Array) -> tuple[float, Array]:
        margin = sign * (design @ weights)
        value = weight @ np.logaddexp(0, -margin)
        slope = design.T @ (-weight * sign / (1 + np.exp(np.clip(margin, -500, 500))))
        ridge = RIDGE / 2 * (weights[1:] ** 2).sum()
        slope[1:] += RIDGE * weights[1:]
        return float(value + ridge), slope

    bounds: list[tuple[float | None, float | None]] = [(None, None)]
    for index, (direction, least) in enumerate(zip(SIGNS, LEAST, strict=True)):
        limits = (least, None) if direction > 0 else (None, -least)
        bounds.append((0.0, 0.0) if index in without else limits)
    start = np.append(0.0, np.array(SIGNS, dtype=float))
    start[[1 + index for index in without]] = 0.0
    found = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds)
    weights: Array = found.x
    return weights


def weights_of(samples: Sequence[Sample]) -> Array:
    """How much each pose of all samples counts (P,), together 1."""
    weight = [np.zeros(len(sample.right)) for sample in samples]
    for right, share in ((True, RIGHT), (False, 1 - RIGHT)):
        count = Counter(sample.kind for sample in samples if (sample.right == right).any())
        for own, sample in zip(weight, samples, strict=True):
            chosen = sample.right == right
            own[chosen] = share / max(chosen.sum() * count[sample.kind], 1)
    every: Array = np.concatenate(weight)
    every /= max(every.sum(), np.finfo(float).tiny)
    return every


def predict(weights: Array, features: Array, centre: Array) -> Array:
    """Probabilities (P,) of features (P, F)."""
    score = weights[0] + (features - centre) @ weights[1:]
    chances: Array = 1 / (1 + np.exp(-np.clip(score, -30, 30)))
    return chances


def kinds(group: str) -> set[str]:
    """The kinds of scene of a group of scans: ``{"room"}`` of ``"room-1+room-2"``."""
    names = {name.partition("~")[0] for name in group.split("+")}
    return {KINDS.get(name, name.partition("-")[0]) for name in names}


def kind(group: str) -> str:
    """What a group counts as: its kinds of scene together."""
    return "+".join(sorted(kinds(group)))


def cross_validated(
    samples: Mapping[str, Sample],
    asked: Mapping[str, Array],
    centre: Array,
    without: Sequence[int] = (),
) -> dict[str, Array]:
    """Probabilities of each group's features `asked` (P, F), fitted to samples of other kinds."""
    found = {}
    for group, features in asked.items():
        others = [
            one for name, one in samples.items()
            if not kinds(name) & kinds(group) and len(one.right)
        ]  # fmt: skip
        if any(other.right.any() for other in others):
            found[group] = predict(fit(others, centre, without), features, centre)
    return found


def reliability(chances: Array, right: Flags, edges: Array) -> list[tuple[float, float, int]]:
    """Of the poses between each two edges: mean probability, share that is right, how many.

    Bins without poses are left out.
    """
    found = []
    bins = np.clip(np.searchsorted(edges, chances, side="right") - 1, 0, len(edges) - 2)
    for index in range(len(edges) - 1):
        inside = bins == index
        if inside.any():
            found.append(
                (float(chances[inside].mean()), float(right[inside].mean()), int(inside.sum()))
            )
    return found
