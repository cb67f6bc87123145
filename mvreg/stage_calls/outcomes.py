"""What the answers of strategies and adjustments are held against."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mvreg.stage_calls.nonsense import NonsenseError, be, listed
from mvreg.types import Pair, Result, View
from mvreg.types.checks import shown

IDENTITY = np.eye(4)


def strategy(answer: Any, views: Sequence[View], *_: Any) -> None:
    """Every view once: placed, in a component or unregistered; the reference at the identity."""
    be(answer, Result)
    for pair in answer.pairs:
        if not isinstance(pair, Pair):
            raise NonsenseError(f"a Result whose pairs contain {shown(pair)}")
        if strange := {pair.source, pair.target} - {view.name for view in views}:
            raise NonsenseError(f"a pair of unknown {listed(sorted(strange))}")
        if pair.verdict.reliable and pair.T_target_source is None:
            raise NonsenseError(f"a pair of {pair.source!r} that is reliable without a pose")
    poses = (answer.poses, *answer.components)
    _each_once([*(name for part in poses for name in part), *answer.unregistered], views)
    if not np.array_equal(answer.poses[answer.reference], IDENTITY):
        raise NonsenseError(
            f"a pose of the reference {answer.reference!r} that is not the identity"
        )


def adjust(answer: Any, result: Result, *_: Any) -> None:
    """The same scans in the same places, the first of each component where it was."""
    be(answer, Result)
    if answer.reference != result.reference:
        raise NonsenseError(f"the reference {answer.reference!r}, which was {result.reference!r}")
    if len(answer.components) != len(result.components):
        raise NonsenseError(f"{len(answer.components)} components of {len(result.components)}")
    both = [(result.poses, answer.poses, result.reference)] + [
        (old, new, next(iter(old), None))
        for old, new in zip(result.components, answer.components, strict=True)
    ]
    for old, new, first in both:
        if old.keys() != new.keys():
            raise NonsenseError(f"poses of {listed(new)}, which were of {listed(old)}")
        if first is not None and not np.array_equal(old[first], new[first]):
            raise NonsenseError(f"another pose of {first!r}, which has to stay")
    if set(answer.unregistered) != set(result.unregistered):
        raise NonsenseError(
            f"{listed(answer.unregistered)} unregistered, which was {listed(result.unregistered)}"
        )


def _each_once(names: list[str], views: Sequence[View]) -> None:
    """Refuse a result that forgets a view, has one twice, or invents one."""
    wanted = {view.name for view in views}
    for fault, found in (
        ("without", wanted - set(names)),
        ("with unknown", set(names) - wanted),
        ("that names more than once", {name for name in names if names.count(name) > 1}),
    ):
        if found:
            raise NonsenseError(f"a Result {fault} {listed(sorted(found))}")
