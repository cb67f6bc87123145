"""What instruments get wrong: errors of range, mixed pixels, losses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.geometry.arrays import Flags
from mvreg.types import Array

#: A pixel is at an edge where the range jumps by more than this many times its width there; an
#: incidence of 84 degrees makes a jump of 10.
EDGE = 10.0


@dataclass(frozen=True)
class RangeError:
    """How far measured ranges are off: Gaussian, and rounded.

    Parameters
    ----------
    constant, linear, quadratic : float
        The standard deviation of a range r is ``constant + linear * r + quadratic * r**2`` (m).
    step : float
        Ranges are rounded to multiples of this (m); 0 does not round.
    disparity : float
        Inverse ranges are rounded to multiples of this (1/m), as a stereo camera's disparities
        are; 0 does not round.
    """

    constant: float = 0.0
    linear: float = 0.0
    quadratic: float = 0.0
    step: float = 0.0
    disparity: float = 0.0

    def __call__(self, ranges: Array, factor: float, rng: np.random.Generator) -> Array:
        """Ranges as measured, with `factor` times the errors; never behind the instrument."""
        sigma = self.constant + self.linear * ranges + self.quadratic * ranges**2
        measured = ranges + factor * sigma * rng.standard_normal(ranges.shape)
        if factor * self.step > 0:
            measured = factor * self.step * np.round(measured / (factor * self.step))
        measured = np.maximum(measured, 1e-3)
        if factor * self.disparity > 0:
            unit = factor * self.disparity
            measured = 1 / (unit * np.maximum(np.round(1 / (unit * measured)), 1))
        return measured


def farthest_neighbours(ranges: Array, wraps: bool) -> Array:
    """For each pixel of a picture the range, among its four neighbours, that differs most.

    A neighbour without a range does not count.

    Parameters
    ----------
    ranges : (rows, columns) array
        Infinite where nothing was met.
    wraps : bool
        Whether the last column is beside the first.
    """
    padded = np.pad(ranges, ((0, 0), (1, 1)), mode="wrap" if wraps else "edge")
    padded = np.pad(padded, ((1, 1), (0, 0)), mode="edge")
    around = np.stack([padded[1:-1, :-2], padded[1:-1, 2:], padded[:-2, 1:-1], padded[2:, 1:-1]])
    around = np.where(np.isfinite(around), around, ranges)
    with np.errstate(invalid="ignore"):
        jumps = np.nan_to_num(np.abs(around - ranges), nan=0.0)
    farthest: Array = np.take_along_axis(around, jumps.argmax(axis=0)[None], axis=0)[0]
    return farthest


def mix(ranges: Array, width: float, share: float, wraps: bool, rng: np.random.Generator) -> Array:
    """Mixed pixels: at an edge, a beam meets two surfaces and its range is between theirs.

    Parameters
    ----------
    ranges : (rows, columns) array
        Infinite where nothing was met.
    width : float
        Angle between neighbouring pixels (radians), the larger of both directions.
    share : float
        Of the pixels at edges, so many are mixed.
    wraps : bool
        Whether the last column is beside the first.
    """
    chance, weight = rng.random((2, *ranges.shape))
    seen = np.isfinite(ranges)
    own = np.where(seen, ranges, 0)
    other = np.where(seen, farthest_neighbours(ranges, wraps), 0)
    edge = np.abs(other - own) > EDGE * width * np.minimum(own, other)
    mixed: Array = np.where(edge & (chance < share), ranges + weight * (other - own), ranges)
    return mixed


def survivors(ranges: Array, cosines: Array, lost: float, grazing: float,
              rng: np.random.Generator) -> Flags:  # fmt: skip
    """Which pixels come back (rows, columns).

    Parameters
    ----------
    ranges, cosines : (rows, columns) arrays
        Infinite where nothing was met; of the angles of incidence.
    lost : float
        Share that is lost at random.
    grazing : float
        Angle of incidence (degrees) from which on more and more are lost, all at 90; 90 loses none.
    """
    angles = np.degrees(np.arccos(np.clip(cosines, 0, 1)))
    chances = np.full(ranges.shape, 1.0 - lost)
    if grazing < 90:
        chances *= np.clip((90 - angles) / (90 - grazing), 0, 1)
    return np.isfinite(ranges) & (rng.random(ranges.shape) < chances)
