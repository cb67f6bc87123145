"""Which pairs of scans meet under a pose: of a scan with a scan, or with every part of a model."""

from __future__ import annotations

from mvreg.evidence.pooling import ViewPair
from mvreg.evidence.view_pair import parts_that_may_meet
from mvreg.types import Array, Model, View


def view_pairs(source: View, target: View, T_target_source: Array, step: int = 1) -> list[ViewPair]:
    """Of a scan with a view: with every part that it may meet, if it is a model that has parts."""
    if not isinstance(target, Model) or not target.parts:
        return [ViewPair(source, target, T_target_source, step=step)]
    return [
        ViewPair(source, view, pose, step=step)
        for view, pose in parts_that_may_meet(source, target, T_target_source)
    ]
