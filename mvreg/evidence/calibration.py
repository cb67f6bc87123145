"""The weights of the evidence, fitted by ``experiments/calibration/calibrate.py``.

To poses of objects, rooms, offices, streets and desks, each kind of scene and sensor counting the
same, with 40 % of right poses: the share among the best poses of attempts. Those of "none" were
fitted to objects alone. Fitted to all kinds, right poses of a campus are less probable (0.92 rather
than 0.955), and 10 of its 20 scans are placed rather than 20; what they take for right in rooms is
refused by a threshold of its own, `EvidenceJudge.min_probability_blind`.
"""

from __future__ import annotations

import numpy as np

from mvreg.types import Array

#: What the columns of `features` are.
FEATURES = ("surface_overlap", "residual", "misfit", "agreement", "violation", "residual_step")
#: Intercept and weights, by what is known of the sensors: what the scans say, what their points
#: tell (`mvreg.surface.sensor`), nothing.
WEIGHTS: dict[str, tuple[float, ...]] = {
    "known": (3.09, 0.50, -1.50, -1.51, 0.25, -2.39, -0.50),
    "estimated": (2.73, 0.50, -1.31, -1.58, 0.25, -2.43, -0.50),
    "none": (1.89, 0.50, -1.32, -3.30, 0.25, 0.00, -1.39),
}
#: The probability that a wrong pose agrees with what the other pairs of a loop say: they do so more
#: often than by chance alone, since rooms and streets repeat themselves.
LOOP_CHANCE = 0.2
#: The name in `mvreg.types.Verdict.evidence` of the probability that the loop is right which made a
#: pair reliable.
LOOP = "loop_probability"
#: Shares are kept so far from 0 and 1, so that logarithms stay finite.
LEAST_SHARE = 0.005
#: More is no further evidence, and excuses no misfit: slides along smooth surfaces have as much.
ENOUGH_SURFACE_OVERLAP, ENOUGH_AGREEMENT = 0.5, 0.95
#: Fewer violations are chance, as at the edges of a scan, and count as so many. Of the log losses
#: of other kinds of scene than those fitted to, 0.01 has the least with known sensors (0.0305; with
#: 0.002 and 0.02 0.0337 and 0.0326), and about so with estimated ones (0.0259; 0.0262, 0.0305).
LEAST_VIOLATION = 0.01
#: Of two poses of the same scans, which see the same edges, fewer violations count: down to this
#: share, or so many points.
LEAST_COMPARED, LEAST_COUNTED = 0.002, 5
#: A residual step much smaller than this is none (resolutions).
LEAST_STEP = 0.25
#: The centre of the features, so that the intercept says what balances.
CENTRE = (0.0, 1.0, -1.0, 2.0, -3.7, -1.0)


def features(
    surface_overlap: float,
    residual: float,
    noise: float,
    agreement: float,
    violation: float | None,
    residual_step: float,
    least_violation: float = LEAST_VIOLATION,
) -> Array:
    """What goes into the probability (6,): each grows with one thing that was measured.

    Log odds of the overlap; logarithms of the residual over the noise floor and over the
    resolution; log odds of the normals' agreement; logarithms of the violation, of
    `least_violation` at least, and of the residual step.
    """
    residual = max(residual, 1.0)  # better than the scans themselves is chance
    misfit = max(residual * noise, 1e-3)
    return np.array(
        [
            _logit(min(surface_overlap, ENOUGH_SURFACE_OVERLAP)),
            np.log(residual),
            np.log(misfit),
            _logit(min(agreement, ENOUGH_AGREEMENT)),
            np.log(max(violation or 0.0, least_violation)),
            np.log(residual_step + LEAST_STEP),
        ]
    )


def probability(values: Array, sensor: str) -> float:
    """The probability of being right, given `features` (6,) and what is known of the sensors."""
    return float(1 / (1 + np.exp(-np.clip(log_odds(values, sensor), -30.0, 30.0))))


def log_odds(values: Array, sensor: str) -> float:
    """The logarithm of the odds of being right, as of `probability`."""
    intercept, *weights = WEIGHTS[sensor]
    return float(intercept + np.dot(weights, values - np.array(CENTRE)))


def _logit(share: float) -> float:
    share = min(max(share, LEAST_SHARE), 1 - LEAST_SHARE)
    return float(np.log(share / (1 - share)))


def in_a_loop(probability: float) -> float:
    """The probability of a pose, given that an independent pair agrees with it."""
    right, wrong = probability, (1 - probability) * LOOP_CHANCE
    return right / (right + wrong)
