"""How much each piece of evidence counts; fitted by ``experiments/evidence.py``."""

from __future__ import annotations

import numpy as np

from mvreg.types import Array

#: What the columns of `features` are.
FEATURES = ("overlap", "residual", "misfit", "agreement", "violation")
#: Intercept and weights, by what is known of the sensors: what the scans say, what their points
#: tell (`mvreg.sensor_estimate`), nothing.
WEIGHTS: dict[str, tuple[float, ...]] = {
    "known": (0.0, 1.0, -3.0, -2.0, 1.0, -1.5),
    "estimated": (0.0, 1.0, -3.0, -2.0, 1.0, -1.5),
    "none": (-1.0, 1.0, -3.0, -2.0, 1.0, 0.0),
}
#: Shares are kept so far from 0 and 1, so that logarithms stay finite.
LEAST_SHARE = 0.005
#: The centre of the features, so that the intercept says what balances.
CENTRE = (0.0, 1.0, -1.0, 2.0, -3.0)


def features(
    overlap: float, residual: float, noise: float, agreement: float, violation: float | None
) -> Array:
    """What goes into the probability (5,): each grows with one thing that was measured.

    Log odds of the overlap; logarithms of the residual over the noise floor and over the
    resolution; log odds of the normals' agreement; logarithm of the violation.
    """
    residual = max(residual, 1.0)  # better than the scans themselves is chance
    misfit = max(residual * noise, 1e-3)
    return np.array(
        [
            _logit(overlap),
            np.log(residual),
            np.log(misfit),
            _logit(agreement),
            np.log(max(violation or 0.0, LEAST_SHARE)),
        ]
    )


def probability(values: Array, sensor: str) -> float:
    """The probability of being right, given `features` (5,) and what is known of the sensors."""
    intercept, *weights = WEIGHTS[sensor]
    score = intercept + np.dot(weights, values - np.array(CENTRE))
    return float(1 / (1 + np.exp(-np.clip(score, -30.0, 30.0))))


def _logit(share: float) -> float:
    share = min(max(share, LEAST_SHARE), 1 - LEAST_SHARE)
    return float(np.log(share / (1 - share)))
