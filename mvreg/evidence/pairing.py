"""Which pairs of scans meet under a pose: of a scan with a scan, or with every part of a model."""

from __future__ import annotations

from mvreg.evidence.pooling import ViewPair
from mvreg.evidence.view_pair import parts_that_may_meet
from mvreg.types import Array, Model, View

#: Under what the view pairs that a view was last asked for as a target are kept in it.
LAST = f"{__name__}.last"


def view_pairs(source: View, target: View, T_target_source: Array, step: int = 1) -> list[ViewPair]:
    """Of a scan with a view: with every part that it may meet, if it is a model that has parts.

    Those of all points that were asked for last are kept on the target, with their evidence: a pose
    is judged, judged again beside those that a symmetry allows, and looked at once more if refused.
    """
    if step != 1:
        return _view_pairs(source, target, T_target_source, step)
    asked = T_target_source.tobytes()
    kept: tuple[View, bytes, list[ViewPair]] | None = vars(target).get(LAST)
    if kept is None or kept[0] is not source or kept[1] != asked:
        kept = source, asked, _view_pairs(source, target, T_target_source, step)
        vars(target)[LAST] = kept
    return kept[2]


def _view_pairs(source: View, target: View, T_target_source: Array, step: int) -> list[ViewPair]:
    if not isinstance(target, Model) or not target.parts:
        return [ViewPair(source, target, T_target_source, step=step)]
    return [
        ViewPair(source, view, pose, step=step)
        for view, pose in parts_that_may_meet(source, target, T_target_source)
    ]
