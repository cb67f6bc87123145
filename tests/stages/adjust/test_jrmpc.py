from dataclasses import replace

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages.adjust.jrmpc import em, gmm, stage
from mvreg.stages.adjust.jrmpc.stage import JointMixture
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.testing.adjust import nearly_right
from mvreg.testing.results import misplacement
from mvreg.testing.scans import degenerate_points
from mvreg.testing.views import moved_view
from mvreg.types import Result

#: EM's arguments, as the stage's defaults have them.
USUAL = {"outlier_ratio": 0.1, "draws": 3, "iterations": 10}


def off(result: Result) -> float:
    """How far the worst point is from where it belongs, in resolutions."""
    return misplacement(
        result.poses, blob_scans(3).poses or {}, list(blob_views(3)), result.reference
    )


@pytest.mark.parametrize("degrees", [1.0, 2.0])
def test_it_finds_exact_poses_from_some_degrees_off(degrees: float) -> None:
    begin = nearly_right(degrees, 0.5)
    assert off(begin) > 0.95
    found = JointMixture()(begin, list(blob_views(3)), pipeline())
    assert off(found) < 0.5


def test_the_likelihood_never_falls() -> None:
    """Although every point answers for its nearest components only."""
    begin, views = nearly_right(2.0, 1.0), blob_views(3)
    gap = 0.9 * views[0].scale.resolution
    clouds = [view.points for view in views]
    poses = np.stack([begin.poses[view.name] for view in views])
    found, likelihoods = em.register(clouds, poses, gap, still=0.0, **USUAL)
    assert [len(rising) for rising in likelihoods] == [11, 11, 11]
    for rising in likelihoods:
        assert np.diff(rising).min() > -1e-9 * abs(rising[0])
        assert rising[-1] > rising[0] + 100
    assert not np.allclose(found, poses)


def test_it_stops_when_the_scans_stand_still() -> None:
    clouds, poses = [view.points for view in blob_views(2)], np.stack([np.eye(4)] * 2)
    _, likelihoods = em.register(clouds, poses, 3.0, still=1e6, **USUAL)
    assert len(likelihoods) == 1


def test_components_keep_their_distance_and_leave_no_hole(rng: np.random.Generator) -> None:
    points = rng.uniform(size=(500, 3))
    kept = gmm.thinned(points, 0.2)
    between = np.linalg.norm(kept[:, None] - kept[None], axis=2) + np.eye(len(kept))
    assert between.min() > 0.2
    assert np.linalg.norm(points[:, None] - kept[None], axis=2).min(axis=1).max() <= 0.2


def test_shares_are_those_of_the_whole_mixture(rng: np.random.Generator) -> None:
    """By the formula of the paper, over all components: the nearest few have all of them."""
    points = rng.uniform(size=(300, 3))
    model = gmm.Mixture(points[::20], np.full(15, 0.05**2), 0.9 / 15, 0.1)
    squares = ((points[:, None] - model.means[None]) ** 2).sum(axis=2)
    parts = 0.9 / 15 * np.exp(-squares / 2 / 0.05**2) / (2 * np.pi * 0.05**2) ** 1.5
    posterior = parts / (parts.sum(axis=1) + 0.1)[:, None]
    found = gmm.expect(model, points, None)
    np.testing.assert_allclose(
        found.posterior, np.take_along_axis(posterior, found.chosen, axis=1), atol=1e-9
    )
    assert found.likelihood == pytest.approx(np.log(parts.sum(axis=1) + 0.1).sum())


def test_a_scan_that_touches_nothing_keeps_its_pose() -> None:
    begin, views = nearly_right(), list(blob_views(3))
    away = se3.from_parts(np.eye(3), np.full(3, 1e4))
    last = views[2].name
    poses = {**begin.poses, last: away @ begin.poses[last]}
    found = JointMixture()(replace(begin, poses=poses), views, pipeline())
    np.testing.assert_array_equal(found.poses[last], poses[last])
    second = views[1].name
    assert not np.allclose(found.poses[second], poses[second])


def test_scans_that_touch_nothing_at_all_stay() -> None:
    begin, views = nearly_right(), list(blob_views(3))
    poses = {
        name: se3.from_parts(np.eye(3), np.full(3, 1e4 * k)) @ pose
        for k, (name, pose) in enumerate(begin.poses.items())
    }
    begin = replace(begin, poses=poses)
    assert JointMixture()(begin, views, pipeline()) is begin


@pytest.mark.parametrize("runaway", [0, 1])
def test_a_scan_that_runs_away_keeps_its_pose(
    runaway: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin, views = nearly_right(), list(blob_views(3))
    real = em.register

    def wild(*args: object, **kwargs: object) -> tuple[np.ndarray, list[float]]:
        poses, likelihoods = real(*args, **kwargs)  # type: ignore[arg-type]
        poses[runaway] = se3.from_parts(np.eye(3), np.full(3, 1e3)) @ poses[runaway]
        return poses, likelihoods

    monkeypatch.setattr(em, "register", wild)
    found = JointMixture()(begin, views, pipeline())
    if runaway == 0:  # the reference: nothing can be said in its frame
        assert {name for name in found.poses if found.poses[name] is begin.poses[name]} == set(
            begin.poses
        )
        return
    name, other = views[1].name, views[2].name
    np.testing.assert_array_equal(found.poses[name], begin.poses[name])
    assert not np.allclose(found.poses[other], begin.poses[other])


@pytest.mark.parametrize("name", ["one point", "two points", "duplicates", "collinear"])
def test_too_few_points_fix_no_pose(name: str) -> None:
    assert not stage.fixes_pose(degenerate_points()[name])


@pytest.mark.parametrize("name", ["three points", "planar"])
def test_points_that_span_a_plane_fix_a_pose(name: str) -> None:
    assert stage.fixes_pose(degenerate_points()[name])


def test_what_is_not_placed_stays_so() -> None:
    begin, views = nearly_right(), list(blob_views(3))
    left = views[1].name
    poses = {name: pose for name, pose in begin.poses.items() if name != left}
    found = JointMixture()(replace(begin, poses=poses, unregistered=(left,)), views, pipeline())
    assert found.unregistered == (left,)
    assert set(found.poses) == set(poses)
    assert found.model is None


def test_outliers_do_not_pull() -> None:
    """A fifth as many points again, anywhere in the scans' boxes, changes next to nothing."""
    begin, views = nearly_right(1.0, 0.3), []
    rng = np.random.default_rng(5)
    for view in blob_views(3):
        box = view.points.min(axis=0), view.points.max(axis=0)
        strewn = rng.uniform(*box, size=(len(view.points) // 5, 3))
        normals = np.resize(view.normals, (len(view.points) + len(strewn), 3))
        points = np.concatenate([view.points, strewn])
        views.append(replace(view, points=points, normals=normals))
    assert off(JointMixture()(begin, views, pipeline())) < 0.6


def test_the_reference_need_not_come_first() -> None:
    begin, views = nearly_right(), list(blob_views(3))
    found = JointMixture()(begin, views[::-1], pipeline())
    assert off(found) < 0.5
    np.testing.assert_array_equal(found.poses[begin.reference], np.eye(4))


def test_views_in_other_frames_end_in_the_same_place() -> None:
    begin, views = nearly_right(), list(blob_views(3))
    motion = se3.random(np.random.default_rng(2), 100.0)
    there = [*views[:2], moved_view(views[2], motion)]
    last = views[2].name
    poses = {**begin.poses, last: begin.poses[last] @ se3.invert(motion)}
    found = JointMixture()(replace(begin, poses=poses), there, pipeline())
    back = {**found.poses, last: found.poses[last] @ motion}
    assert off(replace(begin, poses=back)) < 0.5


@pytest.mark.parametrize(
    "wrong",
    [
        {"component_spacing": 0.0},
        {"outlier_ratio": -1.0},
        {"draws": 0},
        {"iterations": 0},
        {"min_overlap": 1.0},
    ],
)
def test_wrong_parameters_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        JointMixture(**wrong)  # type: ignore[arg-type]
