"""The result that partial models amount to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.types import Array, Pair, Result


def outcome(models: PartialModels, scores: Array, pairs: Sequence[Pair]) -> Result:
    """The result that partial models amount to: each in the frame of its most promising view."""
    largest, *others = models.groups()
    components = []
    for members in (largest, *(one for one in others if len(one) > 1)):
        inside = scores[np.ix_(members, members)].sum(axis=1)
        held = [k for k in members if (scan := models.views[k].scan) is not None and scan.fixed]
        first = int(held[0] if held else members[int(inside.argmax())])
        order = [first, *(int(k) for k in members if k != first)]
        frame = se3.invert(models.poses[first])
        poses = {models.views[k].name: frame @ models.poses[k] for k in order}
        poses[models.views[first].name] = np.eye(4)
        components.append(poses)
    left = tuple(models.views[one[0]].name for one in others if len(one) == 1)
    reference = next(iter(components[0]))
    return Result(reference, components[0], left, tuple(pairs), components=tuple(components[1:]))
