"""What a stage's answer is held against: its type, and what was asked."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from mvreg.evidence.pooled import Evidence
from mvreg.types import (
    Array,
    Candidates,
    Features,
    Indices,
    Matches,
    Model,
    Pair,
    Registration,
    Result,
    Sample,
    Scan,
    ScanSet,
    Verdict,
    View,
)
from mvreg.types.checks import integers, shown, unit

IDENTITY = np.eye(4)


class NonsenseError(Exception):
    """What came instead of an answer, in words that follow "got"."""


def _is(answer: Any, cls: type) -> None:
    """Refuse an answer of another type."""
    if not isinstance(answer, cls):
        raise NonsenseError(shown(answer))


def _within(what: str, pairs: Indices, source: int, target: int, of: str) -> None:
    """Refuse positions (M, 2) beyond the source's and target's numbers of what is meant."""
    if not len(pairs):
        return
    for column, size, side in ((0, source, "source"), (1, target, "target")):
        if (largest := pairs[:, column].max()) >= size:
            raise NonsenseError(f"{what} with position {largest}, where the {side} has {size} {of}")


def dataset(answer: Any, *_: Any) -> None:
    """Scans; their points are checked by `Scan`."""
    _is(answer, ScanSet)
    for scan in answer.scans:
        if not isinstance(scan, Scan):
            raise NonsenseError(f"a ScanSet whose scans contain {shown(scan)}")


def downsample(answer: Any, scans: Sequence[Scan], *_: Any) -> None:
    """One sample per scan, and the spacing."""
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise NonsenseError(shown(answer))
    samples, spacing = answer
    if not isinstance(samples, list | tuple) or not all(isinstance(s, Sample) for s in samples):
        raise NonsenseError(f"{shown(samples)} for the samples")
    if len(samples) != len(scans):
        raise NonsenseError(f"{len(samples)} samples of {len(scans)} scans")
    if not isinstance(spacing, int | float | np.number) or not 0 < spacing < np.inf:
        raise NonsenseError(f"{shown(spacing)} for the spacing, which is positive and finite")


def describe(answer: Any, scan: Scan, keypoints: Array, *_: Any) -> None:
    """Features of some of the keypoints."""
    _is(answer, Features)
    if len(answer.keypoints) > len(keypoints):
        raise NonsenseError(f"{len(answer.keypoints)} described keypoints of {len(keypoints)}")


def seed(answer: Any, source: View, target: View) -> None:
    """Matches of the two views' keypoints."""
    _is(answer, Matches)
    counts = len(source.features.keypoints), len(target.features.keypoints)
    _within("Matches.indices", answer.indices, *counts, "keypoints")


def propagate(answer: Any, source: View, target: View, *_: Any) -> None:
    """Candidates, their matches among the two views' keypoints."""
    _is(answer, Candidates)
    counts = len(source.features.keypoints), len(target.features.keypoints)
    for index, matches in enumerate(answer.matches):
        name, found = f"Candidates.matches[{index}]", np.asarray(matches)
        if found.size:
            _within(name, integers(name, found, "M", 2), *counts, "keypoints")


def refine(answer: Any, source: View, target: View, *_: Any) -> None:
    """A registration of the two views that rests on a pair of their points at least."""
    _is(answer, Registration)
    if (answer.source, answer.target) != (source.name, target.name):
        raise NonsenseError(
            f"a registration of {answer.source!r} to {answer.target!r}, "
            f"asked for {source.name!r} to {target.name!r}"
        )
    if not len(answer.pairs):
        raise NonsenseError("a registration without a pair")
    counts = len(source.points), len(target.points)
    _within("Registration.pairs", answer.pairs, *counts, "points")


def judge(answer: Any, *_: Any) -> None:
    """A verdict that gives its reason."""
    _is(answer, Verdict)


def rejected_early(answer: Any, *_: Any) -> None:
    """Yes or no."""
    if not isinstance(answer, bool | np.bool_):
        raise NonsenseError(shown(answer))


def together(answer: Any, *_: Any) -> None:
    """Evidence."""
    _is(answer, Evidence)


def augment(answer: Any, model: Model, source: View, *_: Any) -> None:
    """The model, of the same name and with the source as its last part."""
    _is(answer, Model)
    unit("Model.normals", answer.normals, "N", 3)
    wanted = (*model.members, source.name)
    if (answer.name, answer.members) != (model.name, wanted):
        raise NonsenseError(
            f"a model {answer.name!r} of {', '.join(map(repr, answer.members)) or 'no parts'}, "
            f"which was {model.name!r} of {', '.join(map(repr, model.members))} "
            f"when {source.name!r} came"
        )


def strategy(answer: Any, views: Sequence[View], *_: Any) -> None:
    """Every view once: placed, in a component or unregistered; the reference at the identity."""
    _is(answer, Result)
    for pair in answer.pairs:
        if not isinstance(pair, Pair):
            raise NonsenseError(f"a Result whose pairs contain {shown(pair)}")
    poses = (answer.poses, *answer.components)
    _each_once([*(name for part in poses for name in part), *answer.unregistered], views)
    if not np.array_equal(answer.poses[answer.reference], IDENTITY):
        raise NonsenseError(
            f"a pose of the reference {answer.reference!r} that is not the identity"
        )


def adjust(answer: Any, result: Result, *_: Any) -> None:
    """The same scans in the same places, the first of each component where it was."""
    _is(answer, Result)
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
            raise NonsenseError(f"poses of {_listed(new)}, which were of {_listed(old)}")
        if first is not None and not np.array_equal(old[first], new[first]):
            raise NonsenseError(f"another pose of {first!r}, which has to stay")
    if set(answer.unregistered) != set(result.unregistered):
        raise NonsenseError(
            f"{_listed(answer.unregistered)} unregistered, which was {_listed(result.unregistered)}"
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
            raise NonsenseError(f"a Result {fault} {_listed(sorted(found))}")


def _listed(names: Iterable[str]) -> str:
    """Names for a message."""
    return ", ".join(map(repr, names)) or "none"


#: The check of each kind's calls, by kind and method; given the answer, then the call's arguments.
CHECKS: dict[tuple[str, str], Callable[..., None]] = {
    ("dataset", "__call__"): dataset,
    ("downsample", "__call__"): downsample,
    ("describe", "__call__"): describe,
    ("seed", "__call__"): seed,
    ("propagate", "__call__"): propagate,
    ("refine", "__call__"): refine,
    ("judge", "__call__"): judge,
    ("judge", "rejected_early"): rejected_early,
    ("judge", "together"): together,
    ("augment", "__call__"): augment,
    ("strategy", "__call__"): strategy,
    ("adjust", "__call__"): adjust,
}
