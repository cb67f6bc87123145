"""Which pairs of scans meet under a pose: of a scan with a scan, or with every part of a model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any
from weakref import ref

from mvreg.evidence.pooling import SUBSAMPLING, ViewPair
from mvreg.evidence.view_pair import parts_that_may_meet
from mvreg.types import Array, Model, View

#: Of more parts than so many fewer points of each are asked first: as many in all.
PARTS = 4
#: Under what the evidence of the pose that a view was last asked for as a target is kept in it.
LAST = f"{__name__}.last"


def view_pairs(source: View, target: View, T_target_source: Array, step: int = 1) -> list[ViewPair]:
    """Of a scan with a view: with every part that it may meet, if it is a model that has parts.

    What is measured of all points is kept on the target, of the pose asked for last: a pose is
    judged, judged again beside those that a symmetry allows, and looked at once more if refused.
    Neither view is kept, so that both go once nobody else has them.
    """
    pairs = _view_pairs(source, target, T_target_source, step)
    if step != 1:
        return pairs
    asked = T_target_source.tobytes()
    kept: tuple[ref[View], bytes, list[list[Any]]] | None = vars(target).get(LAST)
    if kept is not None and kept[0]() is source and kept[1] == asked:
        for pair, measured in zip(pairs, kept[2], strict=True):
            pair.measured.extend(measured)
    else:
        vars(target)[LAST] = ref(source), asked, [pair.measured for pair in pairs]
    return pairs


def on_few_points(source: View, target: View, T_target_source: Array) -> Iterator[list[ViewPair]]:
    """The same view pairs on few of the points, then on every `SUBSAMPLING`-th.

    To tell soon that a pose is hopeless: a wrong one may meet a hundred parts of a large model. On
    few points they have as many in all as `PARTS` of them on every `SUBSAMPLING`-th.
    """
    pairs = view_pairs(source, target, T_target_source, SUBSAMPLING)
    if len(pairs) > PARTS:
        step = SUBSAMPLING * -(-len(pairs) // PARTS)
        yield [replace(pair, step=step) for pair in pairs]
    yield pairs


def _view_pairs(source: View, target: View, T_target_source: Array, step: int) -> list[ViewPair]:
    if not isinstance(target, Model) or not target.parts:
        return [ViewPair(source, target, T_target_source, step=step)]
    return [
        ViewPair(source, view, pose, step=step)
        for view, pose in parts_that_may_meet(source, target, T_target_source)
    ]
