"""Which pair to register next so that a hypothesis is confirmed or contradicted by a loop."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import nearest
from mvreg.stages.strategy.best_first.agreement import Hypothesis
from mvreg.stages.strategy.best_first.hypotheses import Hypotheses
from mvreg.types import Array

#: A pair is worth registering if it would overlap so much: right pairs that the search finds have
#: a fifth and more.
LEAST_OVERLAP = 0.2
#: Points nearer than this are one surface (resolutions).
NEAR = 2.0
#: Pairs of views whose middles would be nearest are looked at, so many.
LOOKED_AT = 24


def closing_pair(
    hypotheses: Hypotheses, new: Hypothesis, tried: set[frozenset[int]]
) -> tuple[int, int] | None:
    """The pair of views that would overlap most if a hypothesis were right, and closes a loop.

    Other views of the two groups, or views of a third group that a hypothesis joins to one of them.

    Parameters
    ----------
    hypotheses : Hypotheses
    new : Hypothesis
    tried : set of frozenset of int
        Pairs that have been registered before.

    Returns
    -------
    (int, int) or None
        None where no pair would overlap enough.
    """
    candidates = [
        one for way in _ways(hypotheses, new) for one in _nearest_pairs(hypotheses, *way, tried)
    ]
    best, found = LEAST_OVERLAP, None
    for _, i, j, motion in sorted(candidates, key=lambda one: one[:3])[:LOOKED_AT]:
        share = _overlap(hypotheses, i, j, motion)
        if share > best:
            best, found = share, (i, j)
    return found


def _ways(hypotheses: Hypotheses, new: Hypothesis) -> Iterator[tuple[int, int, Array]]:
    """Pairs of groups and ``T_staying_moving`` that a loop through the hypothesis may close."""
    group = hypotheses.models.group
    ends = int(group[new.source]), int(group[new.target])
    motion = hypotheses.motion(new, ends)
    yield (*ends, motion)
    for other in hypotheses.known:
        own = int(group[other.source]), int(group[other.target])
        shared = set(own) & set(ends)
        if own[0] == own[1] or len(shared) != 1:
            continue
        via = shared.pop()
        third = own[0] if own[1] == via else own[1]
        T_via_third = hypotheses.motion(other, (third, via))
        if via == ends[0]:
            yield third, ends[1], motion @ T_via_third
        else:
            yield third, ends[0], se3.invert(motion) @ T_via_third


def _nearest_pairs(
    hypotheses: Hypotheses, moving: int, staying: int, motion: Array, tried: set[frozenset[int]]
) -> list[tuple[float, int, int, Array]]:
    """The pairs of views of two groups, not tried, whose middles the motion brings nearest.

    Each with the gap between them (length) and the motion; `LOOKED_AT` at most, nearest first.
    """
    models = hypotheses.models
    ends = [
        [k for k in models.members(group).tolist() if len(hypotheses.samples[k])]
        for group in (moving, staying)
    ]
    own, other = (
        np.array([se3.apply(models.poses[k], hypotheses.samples[k]).mean(axis=0) for k in members])
        for members in ends
    )
    if not len(own) or not len(other):
        return []
    gaps = np.linalg.norm(se3.apply(motion, own)[:, None] - other, axis=2)
    found: list[tuple[float, int, int, Array]] = []
    for place in np.argsort(gaps, axis=None, kind="stable").tolist():
        row, column = divmod(place, len(other))
        i, j = ends[0][row], ends[1][column]
        if frozenset((i, j)) not in tried:
            found.append((float(gaps[row, column]), i, j, motion))
        if len(found) == LOOKED_AT:
            break
    return found


def _overlap(hypotheses: Hypotheses, source: int, target: int, motion: Array) -> float:
    """Share of a view's samples that would lie on another view."""
    models = hypotheses.models
    pose = se3.invert(models.poses[target]) @ motion @ models.poses[source]
    view = models.views[target]
    moved = se3.apply(pose, hypotheses.samples[source])
    distances, _ = nearest(view.tree, moved, NEAR * view.scale.resolution)
    return float(np.isfinite(distances).mean()) if len(moved) else 0.0
