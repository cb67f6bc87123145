"""Scans that fall into two models because their files are mirrored, or of another scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.cli.parts import doubts_on_parts
from mvreg.geometry import se3
from mvreg.run import load_method
from mvreg.types import Array, Finding, Result, Scan, ScanSet

AUTO = load_method("auto")


def doubts(change: Sequence[float], others: Sequence[Scan] = ()) -> tuple[Finding, ...]:
    """Of a result with every second scan in another model, which is changed."""
    data = mvreg.dataset("tiny", views=8)
    assert data.poses is not None
    scans, poses = list(data.scans), dict(data.poses)
    for index in range(1, 8, 2):
        name = scans[index].name
        # In the frame of the data, so that the changed model is one rigid body.
        points = se3.apply(poses[name], scans[index].points) * change
        scans[index] = Scan(name, others[index].points if others else points)
        poses[name] = np.eye(4)
    parts: list[dict[str, Array]] = [
        {scan.name: poses[scan.name] for scan in some} for some in (scans[::2], scans[1::2])
    ]
    result = Result(scans[0].name, parts[0], (), (), None, components=(parts[1],))
    found = replace(data, scans=tuple(scans), poses=None)
    return doubts_on_parts(found, result, AUTO, np.random.default_rng(0))


def test_a_mirrored_model() -> None:
    (finding,) = doubts([1, -1, 1])
    assert finding.kind == "mirrored" and len(finding.scans) == 4
    assert "fit the others when mirrored" in finding.text


@pytest.mark.parametrize("factor", [1.05, 0.93])
def test_a_model_of_another_scale(factor: float) -> None:
    (finding,) = doubts([factor] * 3)
    assert finding.kind == "scale"
    assert f"when made {1 / factor:.2f}" in finding.text


def test_models_that_fit_as_they_are_or_not_at_all() -> None:
    assert doubts([1, 1, 1]) == ()
    other = mvreg.dataset("tiny", views=8, shape="blob-0").scans
    assert doubts([1, 1, 1], other) == ()


def test_a_few_scans_tell_nothing() -> None:
    scans = mvreg.dataset("tiny", views=4).scans
    poses = {scan.name: np.eye(4) for scan in scans}
    names = list(poses)
    result = Result(
        names[0], {n: poses[n] for n in names[:2]}, (), (), None,
        components=({n: poses[n] for n in names[2:]},),
    )  # fmt: skip
    assert doubts_on_parts(ScanSet("a", scans), result, AUTO, np.random.default_rng(0)) == ()
