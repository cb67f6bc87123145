"""The best of several candidate poses: screened on few points, refined on all."""

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
SCREENING, FEWER, HOPELESS = 8, 32, 4.0


def thinned(view: View, step: int) -> View:
    """Every `step`-th registration point of a view, and its normal."""
    return replace(view, points=view.points[::step], normals=view.normals[::step])


def screen(
    refine: Refine, source: View, target: View, poses: Iterable[Array], step: int
) -> list[Registration]:
    """Refine poses on every `step`-th point of the source: the best first."""
    few = thinned(source, step)
    _ = target.tree  # built once, before the threads ask for it
    found = in_threads(lambda pose: refine(few, target, pose), list(poses))
    return sorted(found, key=lambda registration: registration.objective)


def refine_best(
    refine: Refine,
    source: View,
    target: View,
    candidates: Candidates,
    hopeless: Callable[[Registration, View], bool] = lambda registration, few: False,
) -> Registration | None:
    """Refine every candidate on a few points, and the best of them on all; None for none.

    `hopeless` is asked of the best of all on few points, and is shown those: if it is, it is the
    answer, since refinement on all points would take longer than anything else. `pairs` are of all
    points in any case.
    """
    if not len(candidates):
        return None
    first = screen(refine, source, target, candidates.poses, FEWER)
    limit = HOPELESS * first[0].objective
    left = [one.T_target_source for one in first if one.objective <= limit]
    best, *others = screen(refine, source, target, left, SCREENING)
    others += first[len(left) :]
    if hopeless(best, thinned(source, SCREENING)):
        found = replace(best, pairs=best.pairs * np.array([SCREENING, 1]))
    else:
        found = refine(source, target, best.T_target_source)
    rivals = np.array([other.T_target_source for other in others]).reshape(-1, 4, 4)
    return replace(found, rivals=rivals)
