"""Partial models grow: what becomes of attempts of one round at the same two of them."""

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.stages.strategy.best_first.attempted import Outcome
from mvreg.stages.strategy.best_first.growth import Growth
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.stages.strategy.best_first.search import Search
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.types import Edge, Pair, Verdict


@pytest.fixture
def growth():
    views = blob_views(3)
    scores = np.ones((3, 3)) - np.eye(3)
    search = Search(scores, PartialModels(views), parts=3, max_failures=10)
    return Growth(search, pipeline(), scores, np.random.default_rng(0), 0.5)


def truth(source, target):
    poses = blob_scans(3).poses
    views = blob_views(3)
    return se3.invert(poses[views[target].name]) @ poses[views[source].name]


def found(growth, source, target, pose):
    """An attempt that a judge relies on, and what came of it."""
    names = [growth.models.views[k].name for k in (source, target)]
    pair = Pair(*names, Verdict(True, 0.0, 1.0, "believed"), pose)
    none = np.empty(0)
    outcome = Outcome((pair,), 0, Edge(*names, pose), np.empty((0, 4, 4)), none, none, ())
    return growth.attempt(source, [target]), outcome


def test_a_second_pose_between_the_same_models_is_a_loop(growth):
    attempts = [found(growth, 0, 1, truth(0, 1)), found(growth, 1, 0, truth(1, 0))]
    assert [growth.learn(*one) for one in attempts] == [True, False]
    assert [pair.verdict.reliable for pair in growth.pairs] == [True, True]
    assert growth.search.in_a_row == 0, "it is no failure"


def test_a_second_pose_that_contradicts_the_first_is_not_relied_on(growth):
    shifted = se3.exp(np.array([0.0, 0.0, 0.0, 30.0, 0.0, 0.0])) @ truth(1, 0)
    attempts = [found(growth, 0, 1, truth(0, 1)), found(growth, 1, 0, shifted)]
    before = [growth.learn(*one) for one in attempts]
    assert before == [True, False]
    assert [pair.verdict.reliable for pair in growth.pairs] == [True, False]
    assert growth.pairs[1].verdict.open_loop
    np.testing.assert_allclose(growth.models.relative(1, 0), truth(0, 1), atol=1e-9)
