"""Close a loop before partial models are joined by a pose that is not nearly certain.

A wrong pose of one pair may look right, on a surface that repeats itself; then a pair of other
views, registered independently, is unlikely to agree with it. If the second pair is reliable by
itself and the loop through both does not close, the join is refused: one of them is wrong, and
nothing says which (Huber and Hebert 2003 call such cycles inconsistent).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.types import Array, Verdict

#: A join of two partial models, of two views or more each, is nearly certain from this confidence
#: on, or where the judge tells none. Of 136 such joins in 48 runs on Bunny, Dragon, Buddha and the
#: figurine, all of them right, 13 have less: ``experiments/accuracy/joins.py``.
CERTAIN = 0.98


def second_pair(
    models: PartialModels, scores: Array, source: int, targets: Sequence[int]
) -> tuple[int, int] | None:
    """The pair of other views of two partial models that promises most; None for none.

    Parameters
    ----------
    models : PartialModels
    scores : (N, N) array
        Overlap scores as they are by now.
    source : int
        View of the one partial model that is about to be registered.
    targets : sequence of int
        Views of the other that it is registered to.
    """
    moving = models.members(int(models.group[source]))
    staying = models.members(int(models.group[targets[0]]))
    if len(moving) < 2 or len(staying) < 2:
        return None
    worth: Array = scores[np.ix_(moving, staying)].copy()
    worth[moving == source] = 0.0
    worth[:, np.isin(staying, targets[:1])] = 0.0
    if not worth.max() > 0:
        return None
    row, column = np.unravel_index(int(worth.argmax()), worth.shape)
    return int(moving[row]), int(staying[column])


def doubtful(verdict: Verdict) -> bool:
    """Whether a reliable pose is less than nearly certain."""
    return verdict.confidence is not None and verdict.confidence < CERTAIN
