"""Why scans fell into two models, where the files may be to blame: mirrored, or of another size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from mvreg.events import ignore
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, nearest
from mvreg.run import Method, run
from mvreg.stages.judge.evidence import EvidenceJudge
from mvreg.types import Array, Finding, Result, Scan, ScanSet

#: A partial model counts from so many scans on; fewer may overlap with nothing.
FEWEST = 3
#: A model is registered by so many of its points.
POINTS = 60_000
#: Sizes of two models of the same object that are told apart, and that still are of the same unit.
LEAST, MOST = 0.01, 0.3
#: Models that show other parts of an object differ in size by so much.
ERRORS = (1.0, 0.97, 1.03)
#: Cells along the longest side of a model.
CELLS = 60
#: So many of the nearest points tell the scale.
KEPT = 0.7
MIRROR = np.array([-1.0, 1.0, 1.0])


def doubts_on_parts(
    scanset: ScanSet, result: Result, method: Method, rng: np.random.Generator
) -> tuple[Finding, ...]:
    """What makes the second largest model fit the first: a mirror, or another size.

    Both are registered as two scans, first as they are. A model of a symmetric object may fit its
    own other half when mirrored, so that it is a question, not a verdict.
    """
    parts = sorted((result.poses, *result.components), key=len, reverse=True)[:2]
    if len(parts) < 2 or len(parts[1]) < FEWEST:
        return ()
    first, second = (_merged(scanset, poses, rng) for poses in parts)
    method = _asking(method)
    names = tuple(parts[1])
    who = f"the {len(names)} scans of the model with {names[0]}"
    pose, factor = _pose(first, second, method), 1.0
    if pose is None and _pose(first, second * MIRROR, method) is not None:
        return (Finding(
            "mirrored", names, f"{who} fit the others when mirrored",
            "are their files left-handed, an axis of the wrong sign or two exchanged?",
        ),)  # fmt: skip
    guess = _size(first) / _size(second)
    for error in ERRORS if abs(guess - 1) < MOST else ():
        if pose is None:
            factor = guess * error
            pose = _pose(first, second * factor, method)
    if pose is None:
        return ()
    factor *= _scale(first, se3.apply(pose, second * factor))
    if abs(factor - 1) < LEAST or _pose(first, second * factor, method) is None:
        return ()
    return (Finding(
        "scale", names, f"{who} fit the others when made {factor:.3g} times as large",
        "are they of another scale?",
    ),)  # fmt: skip


def _asking(method: Method) -> Method:
    """The method, no stricter because of sensors that merged models do not have: it only asks."""
    judge = method.pipeline.judge
    if not isinstance(judge, EvidenceJudge):
        return method
    judge = replace(judge, min_probability_blind=judge.min_probability)
    return replace(method, pipeline=replace(method.pipeline, judge=judge))


def _merged(scanset: ScanSet, poses: Mapping[str, Array], rng: np.random.Generator) -> Array:
    points = np.concatenate([
        se3.apply(poses[scan.name], scan.points) for scan in scanset.scans if scan.name in poses
    ])  # fmt: skip
    chosen = rng.choice(len(points), min(POINTS, len(points)), replace=False)
    centred: Array = points[np.sort(chosen)] - points.mean(axis=0)
    return centred


def _size(points: Array) -> float:
    """RMS radius of a model, each part of its surface once, however many scans saw it."""
    step = float(np.ptp(points, axis=0).max()) / CELLS or 1.0
    cells = np.unique(np.floor(points / step).astype(np.int64), axis=0)
    return step * float(np.sqrt(cells.var(axis=0).sum()))


def _scale(first: Array, second: Array, steps: int = 30) -> float:
    """The scale that makes the second model, all but registered, fit the first best."""
    tree, scale = build_tree(first), 1.0
    moved = second[:: max(1, len(second) // 10_000)]
    for _ in range(steps):
        distances, partners = nearest(tree, moved)
        near = distances <= np.quantile(distances, KEPT)
        source, target = moved[near], first[partners[near]]
        a, b = source.mean(axis=0), target.mean(axis=0)
        left, spread, right = np.linalg.svd((target - b).T @ (source - a))
        signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
        factor = float((spread * signs).sum() / ((source - a) ** 2).sum())
        moved = factor * (moved - a) @ (left * signs @ right).T + b
        scale *= factor
    return scale


def _pose(first: Array, second: Array, method: Method) -> Array | None:
    """From the second model to the first, if that is reliable."""
    scans = [Scan("first", first), Scan("second", second)]
    result, _, _ = run(scans, method, np.random.default_rng(0), ignore)
    if len(result.poses) < 2:
        return None
    return se3.invert(result.poses["first"]) @ result.poses["second"]
