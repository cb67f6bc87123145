from dataclasses import replace

import mvreg_comparators
import numpy as np
import pytest
from mvreg_comparators import surfc
from mvreg_comparators.surfc import SurfaceConsistentStrategy
from mvreg_comparators.visibility import VisibilityJudge
from trees import blobs, knowing, off, truth, turned

import mvreg
import mvreg.surface.range_image
from mvreg import events
from mvreg.config import compose
from mvreg.geometry import se3
from mvreg.plugins.manager import stages
from mvreg.testing import StrategyContract, overlap, pipeline
from mvreg.testing.views import registration

SURFC = SurfaceConsistentStrategy()


class TestSurfaceConsistentStrategy(StrategyContract):
    stage = SURFC


def run(views, pipe, strategy=SURFC):
    return strategy(views, pipe, np.random.default_rng(0))


def test_it_is_installed_under_its_name():
    found = stages()["strategy/surfc"]
    assert (found.cls, found.plugin) == (SurfaceConsistentStrategy, "comparators")
    assert found.origin.startswith("mvreg-comparators ")
    assert stages()["judge/visibility"].cls is VisibilityJudge


@pytest.mark.parametrize("name", ["surfc", "spant"])
def test_the_presets_spell_out_every_choice(name):
    composed = compose.compose([f"+method={name}"])
    found = compose.stages_from(composed)
    assert composed.method == name
    assert type(found["strategy"]) is mvreg_comparators.mvreg_stages()[f"strategy/{name}"]
    changed = compose.compose([f"+method={name}", "judge=point_to_plane"])
    assert type(compose.stages_from(changed)["judge"]).__name__ == "PointToPlaneJudge"


def test_every_pair_is_registered_once():
    views = blobs(4)
    result = run(views, knowing(4))
    assert [(pair.source, pair.target) for pair in result.pairs] == [
        (f"blob_{j}", f"blob_{i}") for i in range(4) for j in range(i + 1, 4)
    ]
    assert off(result, 4) < 0.1
    assert result.model is None


def test_observers_see_reference_pairs_and_places():
    told = []
    run(blobs(3), knowing(3).observed_by(told.append))
    kinds = [type(event) for event in told]
    assert kinds[0] is events.ReferenceChosen
    assert kinds.count(events.PairRegistered) == 3
    assert [e.name for e in told if type(e) is events.ViewPlaced] == ["blob_1", "blob_2"]


def test_a_wrong_pair_is_caught_by_the_local_test(monkeypatch):
    charge(monkeypatch, {("1", "0"): 0.0})
    instead = {("blob_1", "blob_0"): turned(3, "blob_1", "blob_0")}
    fooled = run(blobs(3), knowing(3, instead))
    assert off(fooled, 3) > 100  # the cheapest edge of all comes first
    result = run(blobs(3), knowing(3, instead, VisibilityJudge()))
    assert result.unregistered == ()
    assert off(result, 3) < 0.1
    assert [pair.verdict.reliable for pair in result.pairs] == [False, True, True]
    assert "free" in result.pairs[0].verdict.reason


def charge(monkeypatch, costs):
    """Let pairs (source, target) cost what is given, and others 9."""
    monkeypatch.setattr(surfc, "cost", lambda found, a, b: costs.get((a.name[-1], b.name[-1]), 9.0))


@pytest.fixture
def planted(monkeypatch):
    """A chain 0-1-2-3 and, before its last link, a wrong edge from 3 to 0 that everybody trusts."""
    charge(monkeypatch, {("1", "0"): 1.0, ("2", "1"): 2.0, ("3", "0"): 3.0, ("3", "2"): 4.0})
    wrong = turned(4, "blob_3", "blob_0", 180.0)
    cut = {("blob_2", "blob_0"): None, ("blob_3", "blob_1"): None}
    return knowing(4, {**cut, ("blob_3", "blob_0"): wrong})


def test_a_planted_wrong_edge_is_caught_by_the_global_test(planted):
    result = run(blobs(4), planted)
    assert result.unregistered == ()
    assert off(result, 4) < 0.1
    fooled = run(blobs(4), planted, replace(SURFC, max_violation=1.0))
    assert off(fooled, 4) > 100


def test_without_sensors_the_global_test_has_no_say(planted):
    views = [replace(view, scan=replace(view.scan, view_direction=None)) for view in blobs(4)]
    assert off(run(views, planted), 4) < 0.1  # an estimated direction will do
    known = replace(SURFC, sensor=mvreg.surface.range_image.Sensor.known)
    assert off(run(views, planted, known), 4) > 100


def test_scans_that_hide_from_each_other_may_stand_so():
    """Opposite sides of the blob see nothing of each other; that is no violation."""
    views, poses = blobs(9), truth(9)
    front, back = views[0], views[4]
    pose = se3.invert(poses[front.name]) @ poses[back.name]
    witnesses = [(view, SURFC.image(view)) for view in (back, front)]
    sights = SURFC.sights(*witnesses, pose)
    assert all(sight.behind > 0.5 for sight in sights)
    assert SURFC.consistent(*witnesses, pose)
    nearer = se3.from_parts(np.eye(3), 150 * front.scan.view_direction) @ pose
    assert not SURFC.consistent(*witnesses, nearer)


def test_what_the_reference_s_tree_does_not_reach_is_reported():
    cut = {(f"blob_{j}", f"blob_{i}"): None for i in (0, 1) for j in (2, 3)}
    result = run(blobs(4), knowing(4, cut))
    assert list(result.poses) == ["blob_0", "blob_1"]
    assert result.unregistered == ("blob_2", "blob_3")
    assert len(result.pairs) == 6


def test_a_violation_of_few_points_does_not_count(planted):
    assert off(run(blobs(4), planted, replace(SURFC, min_evidence=1.0)), 4) > 100
    with pytest.raises(mvreg.InputError, match=r"^min_evidence: expected a share"):
        replace(SURFC, min_evidence=2.0)


def test_two_views_and_the_core_s_pipeline():
    result = run(blobs(2), replace(pipeline(), judge=VisibilityJudge()))
    assert result.unregistered == ()
    assert off(result, 2) < 2


def test_an_edge_is_worth_its_fit_to_the_surface():
    pair = overlap()
    found = registration(pair.source, pair.target, pair.T_target_source)
    lifted = se3.from_parts(np.eye(3), 0.5 * pair.target.scan.view_direction)
    worse = replace(found, T_target_source=lifted @ pair.T_target_source)
    costs = [surfc.cost(one, pair.source, pair.target) for one in (found, worse)]
    assert 0 < costs[0] < costs[1]
