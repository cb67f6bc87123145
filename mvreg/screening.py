"""Choose among candidate poses: screen on few points, refine the best on all."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from mvreg.contracts import Refine
from mvreg.parallel import in_threads
from mvreg.types import Array, Candidates, Registration, View

#: Candidates are compared, and brought near their optimum, on every n-th registration point: first
#: all of them on a few, then on more those that are no worse than so many times the best. Of Dragon
#: in six runs that costs no attempt more than all of them on more; the best three alone cost half
#: as many again.
FINE_STEP, COARSE_STEP, MAX_OBJECTIVE_RATIO = 8, 32, 4.0
#: Those no worse than so many times are no better, but may be as probable: they are brought near
#: their optimum, too, to be told beside the best. In a symmetric yard the right pose, with less
#: overlap than the one half a turn off, had five times as much.
RIVAL_RATIO = 10.0


def thinned(view: View, step: int) -> View:
    """Every `step`-th registration point of a view, and its normal."""
    return replace(view, points=view.points[::step], normals=view.normals[::step])


def screen(
    refine: Refine, source: View, target: View, poses: Iterable[Array], step: int
) -> list[Registration]:
    """Refine poses on every `step`-th point of the source: the best first."""
    subsampled = thinned(source, step)
    _ = target.tree  # built once, before the threads ask for it
    found = in_threads(lambda pose: refine(subsampled, target, pose), list(poses))
    return sorted(found, key=lambda registration: registration.objective)


def refine_best(
    refine: Refine,
    source: View,
    target: View,
    candidates: Candidates,
    rejected_early: Callable[[Registration, View], bool] = lambda registration, subsampled: False,
) -> Registration | None:
    """Refine every candidate on a few points, and the best of them on all; None for none.

    `rejected_early` is asked of the best of all on few points, and is shown those: if it is, it is
    the answer, since refinement on all points would take longer than anything else. `pairs` are of
    all points in any case.
    """
    if not len(candidates):
        return None
    first = screen(refine, source, target, candidates.poses, COARSE_STEP)
    limit = MAX_OBJECTIVE_RATIO * first[0].objective
    left = [one.T_target_source for one in first if one.objective <= limit]
    best, *others = screen(refine, source, target, left, FINE_STEP)
    near = [one for one in first[len(left) :] if one.objective <= RIVAL_RATIO * first[0].objective]
    if near:
        others += screen(refine, source, target, [one.T_target_source for one in near], FINE_STEP)
    others += first[len(left) + len(near) :]
    if rejected_early(best, thinned(source, FINE_STEP)):
        found = replace(best, pairs=best.pairs * np.array([FINE_STEP, 1]))
    else:
        found = refine(source, target, best.T_target_source)
    alternatives = np.array([other.T_target_source for other in others]).reshape(-1, 4, 4)
    return replace(found, alternatives=alternatives)
