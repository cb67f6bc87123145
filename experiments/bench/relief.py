"""The relief of the column: waves all over, and bosses and hollows of which no two are alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.datasets.relief import bumps
from mvreg.types import Array

#: Of the smooth column (mm).
RADIUS = 40.0
#: Wavelengths and heights of the waves (mm).
WAVES = ((9.0, 0.3), (22.0, 1.0), (45.0, 3.0), (110.0, 8.0))
#: Over so many mm a wave becomes higher or lower: no two places are equally rough.
CHANGE = 90.0
#: Bosses and hollows: so many in a band of the column that is so high (mm).
BAND, EACH = 60.0, 30
#: Their widths (mm), and heights in parts of it, of which one in three is a hollow.
WIDTHS, STEEPNESS = (3.0, 16.0), (0.25, 0.7)


@dataclass(frozen=True, eq=False)
class Bosses:
    """Bosses on the unrolled column: `places` (B, 2), arc and height, and `shapes` (B, 2, 2).

    A shape turns an offset into one that has length 1 at the edge; `heights` (B,) are in mm,
    `reach` (B,) is how far off a boss ends, and `powers` (B,) tells round ones from flat ones.
    """

    places: Array
    shapes: Array
    heights: Array
    reach: Array
    powers: Array


def relief(smooth: Array) -> Array:
    """Heights (N,) over points (N, 3) of the smooth column, outwards (mm)."""
    found: Array = np.zeros(len(smooth))
    for seed, (wave, size) in enumerate(WAVES):
        rough = np.exp(bumps(CHANGE, 0.8, 100 + seed)(smooth)) if wave < CHANGE else 1.0
        found += rough * bumps(wave, size, seed)(smooth)
    arc = RADIUS * np.arctan2(smooth[:, 1], smooth[:, 0])
    first, last = np.floor(smooth[[0, -1], 2] / BAND).astype(int)
    for band in range(first - 1, last + 2):
        found += over(bosses(band), arc, smooth[:, 2])
    return found


def bosses(band: int) -> Bosses:
    """Those of one band of the column, always the same."""
    rng = np.random.default_rng([band + 1000, 0xB055])
    places = rng.uniform(-np.pi * RADIUS, np.pi * RADIUS, EACH), rng.uniform(0, BAND, EACH)
    widths = np.exp(rng.uniform(np.log(WIDTHS[0]), np.log(WIDTHS[1]), EACH))
    slender = rng.uniform(1, 3, EACH)
    turn = rng.uniform(0, np.pi, EACH)
    c, s = np.cos(turn), np.sin(turn)
    axes = np.stack([np.stack([c, s], 1) / (widths * slender)[:, None],
                     np.stack([-s, c], 1) / widths[:, None]], axis=1)  # fmt: skip
    heights = (
        widths
        * rng.uniform(STEEPNESS[0], STEEPNESS[1], EACH)
        * np.where(rng.random(EACH) < 1 / 3, -0.6, 1)
    )
    centres = np.column_stack([places[0], BAND * band + places[1]])
    return Bosses(centres, axes, heights, 2.5 * widths * slender, rng.choice([1.0, 3.0], EACH))


def over(found: Bosses, arc: Array, height: Array) -> Array:
    """What bosses add at points of the unrolled column (mm)."""
    total: Array = np.zeros(len(arc))
    around = 2 * np.pi * RADIUS
    for place, shape, high, reach, power in zip(
        found.places, found.shapes, found.heights, found.reach, found.powers, strict=True
    ):
        rise = height - place[1]
        near = np.flatnonzero(np.abs(rise) < reach)
        along = (arc[near] - place[0] + around / 2) % around - around / 2
        near, along = near[np.abs(along) < reach], along[np.abs(along) < reach]
        offsets = np.stack([along, rise[near]], axis=1) @ shape.T
        total[near] += high * np.exp(-((offsets**2).sum(axis=1) ** power))
    return total
