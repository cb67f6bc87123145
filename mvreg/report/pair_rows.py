"""The parts of a report that tell of attempts: what came of each, and what poses it leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Pair

Row = dict[str, object]
#: What a judge's reason begins with where several poses fit, or none is held.
AMBIGUOUS = "ambiguous"
#: Significant digits of evidence: more are noise, and would double the size of a report.
DIGITS = 6


def pair_rows(pairs: Sequence[Pair]) -> list[Row]:
    """Every attempt, and what its verdict rests on."""
    return [
        {
            "source": pair.source,
            "target": pair.target,
            "verdict": "accepted" if pair.verdict.reliable else "rejected",
            "reason": pair.verdict.reason,
            "confidence": pair.verdict.confidence,
            "T_target_source": pair.T_target_source,
            "answers": answer_rows(pair),
            "evidence": {
                name: float(f"{value:.{DIGITS}g}") for name, value in pair.verdict.evidence.items()
            },
        }
        for pair in pairs
    ]


def answer_rows(pair: Pair) -> list[Row]:
    """The poses of an attempt that may be right, where there are several: the best first."""
    if not pair.answers:
        return []
    poses = np.stack([answer.T_target_source for answer in pair.answers])
    angles = np.rad2deg(se3.rotation_angle(poses, poses[0]))
    return [
        {
            "confidence": answer.confidence,
            "angle_deg": float(angle),
            "apart": answer.apart,
            "T_target_source": answer.T_target_source,
        }
        for answer, angle in zip(pair.answers, angles, strict=True)
    ]


def told_answers(pair: Pair | None, placed: bool) -> Row | None:
    """The poses that an ambiguous attempt leaves, and between which scans; None for no such."""
    if pair is None or placed or not pair.answers:
        return None
    if not pair.verdict.reason.startswith(AMBIGUOUS):
        return None
    return {"source": pair.source, "target": pair.target, "poses": answer_rows(pair)}
