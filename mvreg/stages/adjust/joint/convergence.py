"""How rounds of a refinement come to rest: where they lead, and whether they still get nearer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array

#: A phase also ends when moves have not shrunk to this share in two rounds: contacts that come and
#: go, as where things moved between scans, never come to rest.
STALLED = 0.5
#: Steps of two rounds have one direction if the cosine between them is this, at least, and are slow
#: to shrink if the second is as large as this share of the first. Of 1,000 scans of a column in a
#: row the far end then comes to rest within 0.01 resolutions instead of 0.05, in a round less.
ALIKE, SLOW = 0.8, 0.2


def steps_between(before: Array, after: Array) -> Array:
    """(N, 6): the twists about the origin that lead from poses (N, 4, 4) to others."""
    return np.stack([
        se3.log(new @ se3.invert(old)) for old, new in zip(before, after, strict=True)
    ])  # fmt: skip


def extrapolated(steps: Sequence[Array], motions: Array, free: Sequence[int]) -> Array:
    """Poses where rounds that go on as the last two did would end (Aitken's delta-squared process).

    Ends of long chains of scans follow their contacts by half of the way that is left, round after
    round. Where the last two steps (N, 6) have not one direction, or shrink fast, the poses stay.
    """
    if len(steps) < 2:
        return motions
    last, now = steps[-2].ravel(), steps[-1].ravel()
    squared = float(last @ last)
    ratio = float(now @ last) / squared if squared else 0.0
    alike = ratio * np.sqrt(squared) / (float(np.linalg.norm(now)) or 1.0)
    if alike < ALIKE or not SLOW < ratio < 1 - SLOW:
        return motions
    found = motions.copy()
    for k in free:
        found[k] = se3.project(se3.exp(steps[-1][k] * ratio / (1 - ratio)) @ found[k])
    return found


def stalled(moves: Sequence[float]) -> bool:
    """Whether the last of the moves is hardly smaller than two rounds before."""
    return len(moves) > 2 and moves[-1] > STALLED * moves[-3]
