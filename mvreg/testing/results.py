"""Invariants of every result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.testing.compare import apart, assert_rigid
from mvreg.testing.words import equal, expect, is_a, same_array
from mvreg.types import Array, Pair, Result, Verdict, View


def assert_result(result: Result, views: Sequence[View]) -> None:
    """Every view has a pose or is reported, once; the reference stays where it is."""
    is_a("the answer", result, Result)
    names = [view.name for view in views]
    expect(result.reference in names, f"a reference among {names}", result.reference)
    same_array("the identity for the reference", result.poses[result.reference], np.eye(4))
    placed, left = list(result.poses), list(result.unregistered)
    equal("every view to be placed or reported, once", sorted(placed + left), sorted(names))
    is_a("Result.unregistered", result.unregistered, tuple)
    is_a("Result.pairs", result.pairs, tuple)
    for pose in result.poses.values():
        assert_rigid(pose)
    for pair in result.pairs:
        assert_pair(pair, set(names))


def assert_pair(pair: Pair, names: set[str]) -> None:
    """The record of an attempt is complete, or says that there was no candidate."""
    is_a("every pair", pair, Pair)
    expect(
        {pair.source, pair.target} <= names,
        f"pairs of {sorted(names)}",
        f"{pair.source!r} and {pair.target!r}",
    )
    is_a("Pair.verdict", pair.verdict, Verdict)
    empty = [x is None for x in (pair.T_target_source, pair.overlap, pair.trimmed_mse)]
    expect(
        all(empty) or not any(empty),
        "pose, overlap and trimmed_mse of a pair, or None for all three",
        "some of them",
    )
    expect(not (all(empty) and pair.verdict.reliable), "a pose for a reliable pair", "none")


def misplacement(
    poses: Mapping[str, Array], truth: Mapping[str, Array], views: Sequence[View], reference: str
) -> float:
    """The largest displacement of any point from its true position, in resolutions.

    Parameters
    ----------
    poses, truth : mappings of name to (4, 4) array
        ``T_model_scan`` and ``T_world_scan``; compared in the frame of `reference`.
    views : sequence of View
        Their points are asked.
    reference : str
        The view whose frame is the model's.
    """
    rebased = {name: se3.invert(truth[reference]) @ truth[name] for name in poses}
    return max(
        apart(poses[view.name], rebased[view.name], view.points) / view.scale.resolution
        for view in views
        if view.name in poses
    )
