"""What a stage's answer is held against: its type, and what was asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mvreg.evidence.pooled import Evidence
from mvreg.stage_calls.nonsense import NonsenseError, be, listed
from mvreg.stage_calls.outcomes import adjust, strategy
from mvreg.types import (
    Array,
    Candidates,
    Features,
    Indices,
    Matches,
    Model,
    Registration,
    Sample,
    Scan,
    ScanSet,
    Verdict,
    View,
)
from mvreg.types.checks import integers, shown, unit


def _within(what: str, pairs: Indices, source: int, target: int, of: str) -> None:
    """Refuse positions (M, 2) beyond the source's and target's numbers of what is meant."""
    if not len(pairs):
        return
    for column, size, side in ((0, source, "source"), (1, target, "target")):
        if (largest := pairs[:, column].max()) >= size:
            raise NonsenseError(f"{what} with position {largest}, where the {side} has {size} {of}")


def dataset(answer: Any, *_: Any) -> None:
    """Scans; their points are checked by `Scan`."""
    be(answer, ScanSet)
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
    if empty := [s.name for s, one in zip(scans, samples, strict=True) if not len(one.points)]:
        raise NonsenseError(f"no point of {listed(empty)}")
    if not isinstance(spacing, int | float | np.number) or not 0 < spacing < np.inf:
        raise NonsenseError(f"{shown(spacing)} for the spacing, which is positive and finite")


def describe(answer: Any, scan: Scan, keypoints: Array, *_: Any) -> None:
    """Features of some of the keypoints."""
    be(answer, Features)
    if len(answer.keypoints) > len(keypoints):
        raise NonsenseError(f"{len(answer.keypoints)} described keypoints of {len(keypoints)}")


def described(views: Sequence[View]) -> None:
    """Normals and descriptors of one shape for all scans, or they cannot be compared."""
    for view in views[1:]:
        for field in ("normals", "descriptors"):
            first, other = (getattr(v.features, field).shape[1:] for v in (views[0], view))
            if first != other:
                raise NonsenseError(
                    f"{field} of shape (K, {', '.join(map(str, first))}) for {views[0].name!r} "
                    f"and (K, {', '.join(map(str, other))}) for {view.name!r}"
                )


def seed(answer: Any, source: View, target: View) -> None:
    """Matches of the two views' keypoints."""
    be(answer, Matches)
    counts = len(source.features.keypoints), len(target.features.keypoints)
    _within("Matches.indices", answer.indices, *counts, "keypoints")


def propagate(answer: Any, source: View, target: View, *_: Any) -> None:
    """Candidates, their matches among the two views' keypoints."""
    be(answer, Candidates)
    counts = len(source.features.keypoints), len(target.features.keypoints)
    for index, matches in enumerate(answer.matches):
        name, found = f"Candidates.matches[{index}]", np.asarray(matches)
        if found.size:
            _within(name, integers(name, found, "M", 2), *counts, "keypoints")


def refine(answer: Any, source: View, target: View, *_: Any) -> None:
    """A registration of the two views that rests on a pair of their points at least."""
    be(answer, Registration)
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
    be(answer, Verdict)


def rejected_early(answer: Any, *_: Any) -> None:
    """Yes or no."""
    if not isinstance(answer, bool | np.bool_):
        raise NonsenseError(shown(answer))


def together(answer: Any, *_: Any) -> None:
    """Evidence."""
    be(answer, Evidence)


def augment(answer: Any, model: Model, source: View, *_: Any) -> None:
    """The model, of the same name and with the source as its last part."""
    be(answer, Model)
    unit("Model.normals", answer.normals, "N", 3)
    wanted = (*model.members, source.name)
    if (answer.name, answer.members) != (model.name, wanted):
        raise NonsenseError(
            f"a model {answer.name!r} of {', '.join(map(repr, answer.members)) or 'no parts'}, "
            f"which was {model.name!r} of {', '.join(map(repr, model.members))} "
            f"when {source.name!r} came"
        )


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
