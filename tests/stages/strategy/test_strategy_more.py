"""The loops of `sequential` and `coarse_to_fine`, with scripted pairs and with real ones."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg import events
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages.strategy.coarse_to_fine import (
    CoarseToFineStrategy,
    objective,
    one_round,
    union,
)
from mvreg.stages.strategy.grow import GrowStrategy
from mvreg.stages.strategy.sequential import SequentialStrategy
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.testing.adjust import nearly_right
from mvreg.testing.results import misplacement
from mvreg.testing.views import registration
from mvreg.types import Model, Pair, Part, Result, Verdict


class Scripted:
    """A pipeline that accepts the views named, and remembers what it was asked."""

    def __init__(self, accepts, without=()):
        self.pipeline, self.accepts, self.without = pipeline(), accepts, without
        self.asked, self.drawn = [], []

    def begin(self, reference):
        return self.pipeline.begin(reference)

    def extend(self, model, view, found):
        return replace(model, parts=(*model.parts, Part(view, np.eye(4))))

    def register(self, source, target, graph, rng, early_rejection=np.inf):
        self.asked.append((source.name, target.members, len(graph)))
        self.drawn.append(rng.random())
        if source.name in self.without:
            return None, Pair(source.name, target.name, Verdict(False, np.inf, 0.0, "none"))
        pose = se3.from_parts(np.eye(3), np.full(3, float(len(target.members))))
        verdict = Verdict(source.name in self.accepts, 1.0, 2.0, "scripted")
        found = registration(source, target, pose)
        return found, Pair(source.name, target.name, verdict, pose, 0.5, 1.0)


def in_order(accepts, without=(), count=4):
    scripted = Scripted(accepts, without)
    views = [replace(blob_views(3)[0], name=f"v{i}") for i in range(count)]
    return SequentialStrategy()(views, scripted, np.random.default_rng(0)), scripted


def test_scans_are_integrated_one_by_one_in_the_order_given():
    result, script = in_order({"v1", "v2", "v3"})
    assert script.asked == [
        ("v1", ("v0",), 0), ("v2", ("v0", "v1"), 1), ("v3", ("v0", "v1", "v2"), 2),
    ]  # fmt: skip
    assert result.unregistered == ()
    assert result.reference == "v0"
    assert result.model.members == ("v0", "v1", "v2", "v3")
    np.testing.assert_array_equal(result.poses["v0"], np.eye(4))
    np.testing.assert_array_equal(result.poses["v3"][:3, 3], [3, 3, 3])
    assert len(set(script.drawn)) == 3, "random numbers of its own for every pair"


def test_who_is_refused_is_left_out_and_not_tried_again():
    result, script = in_order({"v2"}, without=("v3",))
    assert [name for name, *_ in script.asked] == ["v1", "v2", "v3"]
    assert script.asked[1][1] == ("v0",), "a refused scan is not in the model"
    assert result.unregistered == ("v1", "v3")
    assert list(result.poses) == ["v0", "v2"]
    assert len(result.pairs) == 3


def test_observers_see_the_sequence():
    told = []
    views = list(blob_views(3))
    pipe = pipeline().observed_by(told.append)
    result = SequentialStrategy()(views, pipe, np.random.default_rng(0))
    placed = [event.name for event in told if isinstance(event, events.ViewPlaced)]
    assert isinstance(told[0], events.ReferenceChosen)
    assert placed == list(result.poses)[1:] == [view.name for view in views[1:]]


def exact():
    views, poses = blob_views(3), blob_scans(3).poses
    first = se3.invert(poses[views[0].name])
    exact = {view.name: first @ poses[view.name] for view in views}
    exact[views[0].name] = np.eye(4)
    return views, exact


def test_the_union_leaves_one_scan_out():
    views, poses = exact()
    partial = {name: poses[name] for name in list(poses)[:2]}
    both, one = union(views, poses, views[2].name), union(views, partial, views[0].name)
    assert len(both.points) == len(views[0].points) + len(views[1].points)
    np.testing.assert_array_equal(both.points[: len(views[0].points)], views[0].points)
    expected = se3.apply(poses[views[1].name], views[1].points)
    np.testing.assert_allclose(one.points, expected)
    back = one.normals @ poses[views[1].name][:3, :3]
    np.testing.assert_allclose(back, views[1].normals, atol=1e-12)


def test_the_objective_is_the_mean_of_psi_and_grows_with_the_errors():
    views, poses = exact()
    near = objective(nearly_right(0.5, 0.3).poses, views)
    far = objective(nearly_right(2.0, 1.5).poses, views)
    assert 0 < objective(poses, views) < near < far
    twin = replace(views[0], name="twin")
    assert objective({views[0].name: np.eye(4), "twin": np.eye(4)}, [views[0], twin]) < 1e-20
    assert objective({views[0].name: np.eye(4)}, views) == 0.0


class Recorded:
    """A refinement that knows the truth and tells how the others lay when it was asked."""

    def __init__(self, poses):
        self.poses, self.seen = poses, []

    def refine(self, source, target, T_init):
        self.seen.append((source.name, target.points))
        return registration(source, target, self.poses[source.name])


def test_a_round_uses_every_new_pose_at_once():
    views, poses = exact()
    start, perfect = nearly_right().poses, Recorded(poses)
    found = one_round(views, start, views[0].name, perfect)
    assert [name for name, _ in perfect.seen] == [view.name for view in views[1:]]
    for name, pose in poses.items():
        np.testing.assert_allclose(found[name], pose, atol=1e-12)
    # The last scan met the second where it belongs, not where it was.
    others = perfect.seen[1][1]
    expected = se3.apply(poses[views[1].name], views[1].points)
    np.testing.assert_allclose(others[len(views[0].points) :], expected)
    np.testing.assert_array_equal(start[views[1].name], nearly_right().poses[views[1].name])


def coarse_from(monkeypatch, result):
    monkeypatch.setattr(GrowStrategy, "__call__", lambda self, views, pipeline, rng: result)


def test_rounds_make_coarse_poses_fine(monkeypatch):
    views, poses = exact()
    coarse = replace(nearly_right(2.0, 1.0), model=Model.of(blob_views()[0]))
    coarse_from(monkeypatch, coarse)
    rng = np.random.default_rng(0)
    found = CoarseToFineStrategy()(views, pipeline(), rng)
    before, after = (misplacement(x.poses, poses, views, x.reference) for x in (coarse, found))
    assert after < 0.3 * before
    assert found.model is None, "the merged model no longer fits"
    assert CoarseToFineStrategy(max_rounds=0)(views, pipeline(), rng) is coarse


def test_rounds_that_make_it_worse_are_not_kept(monkeypatch):
    views, poses = exact()
    coarse = Result(views[0].name, poses, (), ())
    coarse_from(monkeypatch, coarse)
    off = nearly_right(3.0, 3.0).poses
    pipe = replace(pipeline(), refine=Recorded(off).refine)
    assert CoarseToFineStrategy()(views, pipe, np.random.default_rng(0)) is coarse


def test_one_placed_scan_has_nothing_to_be_refined_against(monkeypatch):
    views, _ = exact()
    names = [view.name for view in views]
    alone = Result(names[0], {names[0]: np.eye(4)}, tuple(names[1:]), ())
    coarse_from(monkeypatch, alone)
    assert CoarseToFineStrategy()(views, pipeline(), np.random.default_rng(0)) is alone


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"levels": []}, r"strategy\.levels: expected at least one level"),
        ({"max_rounds": -1}, r"strategy\.max_rounds: expected 0 or more, got -1"),
    ],
)
def test_parameters_out_of_range_are_refused(parameters, message):
    with pytest.raises(InputError, match=message):
        CoarseToFineStrategy(**parameters)
