"""Which pairs of scans meet under a pose: of a scan with a scan, or with every part of a model."""

from __future__ import annotations

import numpy as np

from mvreg.evidence.pooling import ViewPair
from mvreg.evidence.view_pair import may_overlap
from mvreg.geometry import se3
from mvreg.types import Array, Model, View


def view_pairs(source: View, target: View, T_target_source: Array, step: int = 1) -> list[ViewPair]:
    """Of a scan with a view: with every part that it may meet, if it is a model that has parts."""
    if not isinstance(target, Model) or not target.parts:
        return [ViewPair(source, target, T_target_source, step=step)]
    homes = se3.invert(np.stack([part.T_model_scan for part in target.parts]))
    return [
        ViewPair(source, part.view, pose, step=step)
        for part, pose in zip(target.parts, homes @ T_target_source, strict=True)
        if may_overlap(source, part.view, pose)
    ]
