from dataclasses import dataclass, replace

import numpy as np
import pytest

from mvreg import events
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.pipeline import Pipeline, timed
from mvreg.stages.adjust.joint.surface import surfaces
from mvreg.stages.judge.residual import PointToPlaneJudge, TmseJudge
from mvreg.stages.refine.trimmed import TrimmedICP
from mvreg.testing import blob_scans, blob_views, overlap, pipeline
from mvreg.testing.compare import digest
from mvreg.testing.refine import nudge
from mvreg.testing.scans import degenerate_points
from mvreg.testing.views import plain_view
from mvreg.types import Candidates, Scan


def rng():
    return np.random.default_rng(0)


def test_parameters_are_replaced_by_their_dotted_names():
    before = pipeline()
    after = before.with_parameters({"seed.top_fraction": 0.7, "refine.exponent": 1.0})
    assert (after.seed.top_fraction, after.refine.exponent) == (0.7, 1.0)
    assert before == pipeline(), "the old one stays as it was"
    assert replace(after, seed=before.seed, refine=before.refine) == before
    assert before.with_parameters({}) == before


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("seed.top_frction", "top_fraction"),
        ("seed", "top_fraction"),
        ("sead.top_fraction", "downsample, describe, seed"),
        ("emit.x", "downsample, describe, seed"),
        ("strategy.levels", "downsample, describe, seed"),
        ("", "downsample, describe, seed"),
    ],
)
def test_a_name_that_means_nothing_is_refused_with_the_options(name, options):
    with pytest.raises(InputError, match=rf"cannot change {name!r}: .*options: {options}"):
        pipeline().with_parameters({name: 1})


def test_a_parameter_of_another_stage_of_the_kind_is_refused():
    with pytest.raises(InputError, match=r"cannot change 'judge\.max_residual'.*min_overlap"):
        replace(pipeline(), judge=TmseJudge()).with_parameters({"judge.max_residual": 0.1})
    plane = replace(pipeline(), judge=PointToPlaneJudge())
    assert plane.with_parameters({"judge.max_residual": 0.1}).judge.max_residual == 0.1


def test_a_parameter_out_of_range_is_refused():
    with pytest.raises(InputError, match=r"seed\.top_fraction: expected a share"):
        pipeline().with_parameters({"seed.top_fraction": 7})


def test_trees_of_many_raw_points_are_let_go_of(monkeypatch):
    assert all("tree" in vars(view.scan) for view in pipeline().prepare(fresh(), rng()))
    monkeypatch.setattr("mvreg.types.scan.HELD_IN_TREES", 100)
    views = pipeline().prepare(fresh(), rng())
    assert not any("tree" in vars(view.scan) for view in views)
    surfaces(views)
    assert not any("tree" in vars(view.scan) for view in views)


def fresh():
    """Scans of which nothing has been worked out."""
    return [replace(scan) for scan in blob_scans(3).scans]


def test_prepared_views_hold_together():
    scans = blob_scans(3).scans
    told = []
    views = pipeline().observed_by(told.append).prepare(scans, rng())
    assert [view.name for view in views] == [scan.name for scan in scans]
    assert len({view.scale for view in views}) == 1
    resolutions = [view.resolution for view in views]
    assert views[0].scale.resolution == pytest.approx(np.median(resolutions))
    for view, event in zip(views, told, strict=True):
        assert isinstance(event, events.ViewPrepared)
        assert event.view is view
        np.testing.assert_allclose(np.linalg.norm(view.normals, axis=1), 1)
        assert len(view.normals) == len(view.points)
    assert [event.index for event in told] == [0, 1, 2]
    assert {event.total for event in told} == {3}
    assert set(told[0].seconds) == {"downsample", "describe"}
    assert set(told[1].seconds) == {"describe"}


@pytest.mark.parametrize(
    ("names", "found"),
    [([], "0 scan"), (["a"], "1 scan"), (["a", "b", "a", "c", "b"], "a, b twice")],
)
def test_too_few_or_double_scans_are_refused(names, found):
    scans = [Scan(name, np.eye(3)) for name in names]
    with pytest.raises(InputError, match=rf"two scans with different names, got {found}"):
        pipeline().prepare(scans, rng())


@pytest.mark.parametrize("name", list(degenerate_points()))
def test_a_poor_scan_does_not_harm_the_others(name):
    scans = blob_scans(3).scans
    poor = Scan("poor", degenerate_points()[name])
    views = pipeline().prepare([*scans, poor], rng())
    for view in views:
        for array in (view.points, view.normals, view.features.normals, view.features.descriptors):
            assert np.isfinite(array).all()
    assert len(views[0].features.keypoints) == pytest.approx(
        len(blob_views(3)[0].features.keypoints), rel=0.1
    )


def test_only_poor_scans_can_be_prepared_too():
    poor = [Scan(name, points) for name, points in degenerate_points().items()]
    alone = [Scan(name, np.ones((5, 3))) for name in "ab"]
    for scans in (poor, alone):
        for view in pipeline().prepare(scans, rng()):
            assert np.isfinite([view.resolution, view.scale.resolution]).all()
            assert view.scale.spacing > 0


def test_a_pair_is_registered_and_remembered():
    pair, told = overlap(), []
    found, record = (
        pipeline().observed_by(told.append).register(pair.source, pair.target, [], rng())
    )
    assert [type(event) for event in told] == [events.PairStarted, events.PairRegistered]
    assert np.rad2deg(se3.rotation_angle(found.T_target_source, pair.T_target_source)) < 2
    assert record.verdict.reliable
    assert record.T_target_source is found.T_target_source
    assert (record.overlap, record.trimmed_mse) == (found.overlap, found.trimmed_mse)
    assert set(record.seconds) == {"seed", "propagate", "refine", "judge"}
    event = told[1]
    assert event.registration is found
    assert event.pair is record
    assert len(event.candidates) >= 1
    assert len(event.seeds) >= 1


def test_without_a_candidate_there_is_no_registration():
    pair, told = overlap(), []
    bare = plain_view("bare", pair.source.points, pair.source.scale, keypoints=0)
    pipe = pipeline().observed_by(told.append)
    for source, target in [(bare, pair.target), (pair.source, bare)]:
        found, record = pipe.register(source, target, [], rng())
        assert found is None
        assert (record.source, record.target) == (source.name, target.name)
        assert record.T_target_source is None
        assert not record.verdict.reliable
        assert record.verdict.reason == "no candidate pose"
        assert "judge" not in record.seconds
        assert told[-1].registration is None


@dataclass(frozen=True)
class Fixed:
    """Candidates that a test has chosen."""

    poses: tuple

    def __call__(self, source, target, seeds, rng):
        none = np.empty((0, 2), dtype=int)
        return Candidates(np.stack(self.poses), np.arange(len(self.poses)), (none,) *
                          len(self.poses))  # fmt: skip


@pytest.mark.parametrize("place", [0, 1, 2])
def test_the_best_candidate_wins_wherever_it_stands(place):
    """The order of the candidates is the propagation's guess; the refined objective decides."""
    pair = overlap()
    good = pair.T_target_source @ nudge(pair.source, 3.0, 1.0)
    poses = [se3.random(np.random.default_rng(i), 50.0) for i in range(2)]
    poses.insert(place, good)
    pipe = replace(pipeline(), propagate=Fixed(tuple(poses)))
    found, _ = pipe.register(pair.source, pair.target, [], rng())
    alone = TrimmedICP()(pair.source, pair.target, good)
    assert np.rad2deg(se3.rotation_angle(found.T_target_source, alone.T_target_source)) < 2
    assert found.overlap == pytest.approx(alone.overlap, abs=0.05)
    assert len(found.pairs) / len(pair.source.points) == found.overlap, "all points in the end"


def test_a_model_begins_with_the_reference_and_is_extended():
    pair, told = overlap(), []
    pipe = pipeline().observed_by(told.append)
    model = pipe.begin(pair.target)
    assert model.members == (pair.target.name,)
    found, _ = pipe.register(pair.source, model, [], rng())
    grown = pipe.extend(model, pair.source, found)
    assert grown.members == (pair.target.name, pair.source.name)
    assert isinstance(told[0], events.ReferenceChosen)
    assert isinstance(told[-1], events.ViewPlaced)
    assert told[-1].model is grown
    assert told[-1].seconds > 0
    np.testing.assert_array_equal(told[-1].T_model_scan, found.T_target_source)


def test_observed_pipelines_are_the_same_pipeline():
    told = []
    observed = pipeline().observed_by(told.append)
    assert observed.emit == told.append
    assert replace(observed, emit=pipeline().emit) == pipeline()
    assert isinstance(observed, Pipeline)


def test_time_adds_up_even_when_something_fails():
    seconds = {"a": 1.0}
    with timed(seconds, "a"):
        pass
    assert 1.0 < seconds["a"] < 2.0
    with pytest.raises(KeyError), timed(seconds, "b"):
        raise KeyError
    assert seconds["b"] > 0


def test_preparing_twice_is_the_same_to_the_last_bit():
    scans = blob_scans(3).scans
    first, second = (pipeline().prepare(scans, rng()) for _ in range(2))
    assert digest(first) == digest(second)


def test_stages_are_exchanged_by_kind():
    judge = TmseJudge(min_overlap=0.3)
    changed = pipeline().with_stages(judge=judge)
    assert changed.judge is judge
    assert changed.seed == pipeline().seed
    with pytest.raises(InputError, match=r"cannot exchange juge: .*judge"):
        pipeline().with_stages(juge=judge)
