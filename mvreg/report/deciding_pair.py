"""The deciding pair: the attempt that placed a scan or a partial model, or came closest to it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from mvreg.types import Array, Pair, Result


def component_of(result: Result) -> dict[str, int]:
    """The number of the partial model that each scan belongs to, 1 for the reference's."""
    return {
        name: number
        for number, poses in enumerate((result.poses, *result.components), start=1)
        for name in poses
    }


def deciding_pair(name: str, result: Result) -> Pair | None:
    """The attempt that says most about a scan.

    For a placed scan the accepted pair that it came in with, as the source or, where a strategy
    grows a tree of scans, as the target; else the attempt that came closest to its threshold.
    """
    pairs = [pair for pair in result.pairs if name in (pair.source, pair.target)]
    numbers = component_of(result)
    if name not in numbers:
        return closest(pairs)
    inside = {other for other, number in numbers.items() if number == numbers[name]}
    accepted = [p for p in pairs if p.verdict.reliable and {p.source, p.target} <= inside]
    as_source = [pair for pair in accepted if pair.source == name]
    last = (as_source or accepted)[-1:]
    return last[0] if last else None


def joining_pair(poses: Mapping[str, Array], result: Result) -> tuple[Pair | None, int]:
    """The attempt that came closest to joining a partial model to anything, and their number.

    Parameters
    ----------
    poses : mapping
        One of `Result.components`.
    result : Result
    """
    pairs = [pair for pair in result.pairs if (pair.source in poses) != (pair.target in poses)]
    return closest(pairs), len(pairs)


def closest(pairs: Sequence[Pair]) -> Pair | None:
    """The attempt that came closest to its threshold, of those that failed if there are any."""
    return min(pairs, key=lambda pair: (pair.verdict.reliable, _shortfall(pair)), default=None)


def reason_of(pair: Pair | None, placed: bool) -> str | None:
    """Why a scan is placed, or why not."""
    if pair is None:
        return None
    if pair.verdict.reliable and not placed:
        return "accepted at first, then withdrawn"
    return pair.verdict.reason


def _shortfall(pair: Pair) -> float:
    verdict = pair.verdict
    ratio = verdict.score / verdict.threshold if verdict.threshold > 0 else math.inf
    return math.inf if math.isnan(ratio) else ratio
