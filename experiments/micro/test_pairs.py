"""Speed of what is done for a pair of scans: seeds, propagation, refinement."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mvreg.run import load_method
from mvreg.types import Array, Matches, View


@pytest.mark.benchmark(group="seed matches of a pair")
def test_seeds(benchmark: Any, views: list[View]) -> None:
    assert len(benchmark(load_method().pipeline.seed, *views))


@pytest.mark.benchmark(group="all seeds of a pair to candidate poses")
def test_propagate(benchmark: Any, views: list[View], seeds: Matches) -> None:
    stage, (source, target) = load_method().pipeline.propagate, views
    assert len(benchmark(lambda: stage(source, target, seeds, np.random.default_rng(1))))


@pytest.mark.parametrize("method", ["fcpma", "auto"], ids=["trimmed", "point to plane"])
@pytest.mark.benchmark(group="refine a pose that is 5 degrees off")
def test_refine(benchmark: Any, views: list[View], truth: Array, method: str) -> None:
    stage = load_method(method).pipeline.refine
    angle = np.radians(5)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    _ = views[1].tree
    found = benchmark(stage, *views, truth @ turn)
    assert np.linalg.norm(found.T_target_source - truth) < 1
