"""The strategy asks the judge that it is given, about several pairs at once too."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mvreg.evidence.pooled import pool_evidence
from mvreg.library import dataset, register
from mvreg.run import load_method
from mvreg.stages.judge.evidence import EvidenceJudge
from mvreg.stages.judge.residual import PointToPlaneJudge, TmseSurfaceJudge
from mvreg.stages.strategy.best_first.joint_verdict import error_probability, together
from mvreg.stages.strategy.best_first.partial_models import PartialModels
from mvreg.testing import blob_scans, blob_views
from mvreg.types import Verdict


@dataclass(frozen=True)
class Refuses:
    """Relies on nothing, and says whom it was asked about."""

    def __call__(self, registration, source, target, graph):
        ASKED.append((source.name, target.name))
        return Verdict(False, 2.0, 1.0, "never")


ASKED: list[tuple[str, str]] = []


def pairs(turned=False):
    views, truth = blob_views(3), blob_scans(3).poses
    models = PartialModels(views)
    for k in (1, 2):
        models.join(k, 0, np.linalg.inv(truth[views[0].name]) @ truth[views[k].name])
    if turned:
        turn = np.diag([-1.0, -1.0, 1.0, 1.0])
        models.poses[2] = models.poses[2] @ turn
    return models.view_pairs([0, 1, 2], [0, 1, 2])


def test_a_judge_that_pools_is_asked_to():
    found = together(EvidenceJudge(), pairs())
    assert found.probability == pool_evidence(pairs()).probability > 0.95
    assert error_probability(EvidenceJudge(), pairs()) < 0.1


@pytest.mark.parametrize("judge", [PointToPlaneJudge(), TmseSurfaceJudge()])
def test_any_other_is_asked_about_each_pair(judge):
    assert together(judge, pairs()).probability == 1.0
    assert error_probability(judge, pairs()) == 0.0


def test_what_it_refuses_counts():
    ASKED.clear()
    found = together(Refuses(), pairs())
    assert (found.probability, found.reason) == (0.0, "never")
    assert len(ASKED) >= 2
    assert error_probability(Refuses(), pairs()) == 1.0
    assert together(Refuses(), []).probability == 1.0


def test_the_default_strategy_takes_back_what_its_judge_refuses(monkeypatch):
    scans = dataset("tiny", views=4, points=2000)
    method = load_method()
    assert len(register(scans, method).poses) > 1
    stubborn = replace(method, pipeline=method.pipeline.with_stages(judge=Refuses()))
    assert len(register(scans, stubborn).poses) == 1


@pytest.mark.parametrize("judge", ["tmse", "tmse_surface", "point_to_plane", "evidence"])
@pytest.mark.parametrize("strategy", ["best_first", "grow"])
def test_every_judge_places_what_the_default_places(judge, strategy):
    scans = dataset("tiny")
    result = register(scans, changes={"judge": judge, "strategy": strategy})
    assert len(result.poses) == len(scans.scans)


def test_levels_differ_for_the_judge_by_evidence():
    levels = load_method(changes={"strategy": "grow"}).strategy.levels
    assert [level["judge.min_overlap"] for level in levels] == [0.6, 0.5, 0.45]
