from dataclasses import replace

import numpy as np
import pytest
from mvreg_comparators.visibility import Sight, Visibility, VisibilityJudge

import mvreg
from mvreg.geometry import se3
from mvreg.stages import TrimmedICP
from mvreg.surface import RangeImage, Sensor, estimated_direction
from mvreg.testing import JudgeContract, blob_views, overlap
from mvreg.types import Features, Model, Scale, Scan, View

UP = np.array([0.0, 0.0, 1.0])
SPACING = 1.0


class TestVisibilityJudge(JudgeContract):
    stage = VisibilityJudge()


def wall(direction=UP, point=None, half=15, name="wall"):
    """A view of a square of points at z = 0, one apart."""
    axis = np.arange(-half, half + 1) * SPACING
    grid = np.stack(np.meshgrid(axis, axis, [0.0]), axis=-1).reshape(-1, 3)
    normals = np.tile(UP, (len(grid), 1))
    features = Features(grid[:0], np.empty((0, 1, 3)), np.empty((0, 1)), True)
    scan = Scan(name, grid, direction, point)
    return View(name, grid, normals, features, SPACING, Scale(5.0, SPACING), scan)


def seen(view, *points):
    test = Visibility()
    return test.sight(test.image(view), np.array(points, float), SPACING)


def test_a_parallel_sensor_tells_in_front_on_and_behind():
    view = wall()
    assert seen(view, [0.3, 0.2, 9], [3, 4, 2.1]) == Sight(0, 1, 0)
    assert seen(view, [0.3, 0.2, 1.9], [3, 4, -1.9]) == Sight(1, 0, 0)
    assert seen(view, [0.3, 0.2, -9], [3, 4, -2.1]) == Sight(0, 0, 1)


def test_hidden_points_and_those_beside_it_are_neutral():
    view = wall()
    assert seen(view, [0, 0, -9]).violation == 0
    assert seen(view, [40, 0, 9], [40, 0, 0], [0, 40, -9]) == Sight(0, 0, 0)
    assert seen(view, [40, 0, 9]).violation == 0
    assert seen(view, [0, 0, 9], [0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, -9]).violation == 1 / 4


def test_a_central_sensor_looks_along_rays_that_meet():
    eye = np.array([0.0, 0.0, 50.0])
    near, far = [7.0, 0.0, 25.0], [16.0, 0.0, -20.0]  # towards x = 14 and x = 11.4 on the wall
    beside = [14.0, 0.0, 25.0]  # its ray meets the wall's plane at x = 28, beyond the wall
    central, parallel = wall(None, eye), wall()
    assert seen(central, near) == Sight(0, 1, 0)
    assert seen(central, far) == Sight(0, 0, 1)
    assert seen(central, beside) == Sight(0, 0, 0)
    assert seen(parallel, beside) == Sight(0, 1, 0)
    assert seen(parallel, far) == Sight(0, 0, 0)


def test_a_steep_surface_is_no_violation_of_itself():
    """Heights about a ray differ by more than the tolerance where the surface is steep."""
    view = wall()
    steep = view.points * [1, 1, 0] + view.points[:, :1] * [0, 0, 6.0]
    view = replace(view, points=steep, scan=Scan("steep", steep, UP))
    between = steep[steep[:, 0] < 15] + np.array([0.5, 0.0, 3.0])
    assert seen(view, *between).consistent == 1


def test_the_frame_and_the_unit_do_not_matter():
    first, second = blob_views()[:2]
    test, pose = Visibility(), overlap().T_target_source
    image = test.image(second)
    assert image is not None
    points = se3.apply(pose, first.points)
    old = test.sight(image, points, first.scale.resolution)
    motion = se3.random(np.random.default_rng(1), 100.0)
    moved = RangeImage.of(replace(second, scan=second.scan.moved(motion)), Sensor.known)
    assert moved is not None
    assert test.sight(moved, se3.apply(motion, points), first.scale.resolution) == old
    larger = RangeImage(8 * image.points, image.direction, None)
    assert test.sight(larger, 8 * points, 8 * first.scale.resolution) == old


@pytest.mark.parametrize("index", [0, 1, 2])
def test_the_direction_of_a_silent_scan_is_estimated_from_its_surface(index):
    view = blob_views()[index]
    found = estimated_direction(replace(view, normals=view.normals * [[-1], [1]][index % 2]))
    assert found is not None
    assert np.rad2deg(np.arccos(found @ view.scan.view_direction)) < 15


def test_who_says_nothing_has_an_estimate_or_no_say():
    view = blob_views()[0]
    silent = replace(view, scan=replace(view.scan, view_direction=None))
    assert RangeImage.of(silent, Sensor.known) is None
    assert RangeImage.of(silent, Sensor.estimated).direction is not None
    assert RangeImage.of(replace(view, scan=None), Sensor.known) is None
    assert len(RangeImage.of(replace(view, scan=None), Sensor.estimated).points) == len(view.points)
    assert RangeImage.of(Model.of(view), Sensor.estimated) is None


def test_a_surface_without_a_mean_normal_has_no_direction():
    ring = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    view = replace(wall(None), points=ring, normals=ring)
    assert estimated_direction(view) is None


def test_of_a_merged_model_only_the_source_sees():
    pair, judge = overlap(), VisibilityJudge()
    model = Model.of(pair.target)
    right = TrimmedICP()(pair.source, model, pair.T_target_source)
    sights = judge.sights(
        (pair.source, judge.image(pair.source)), (model, judge.image(model)), pair.T_target_source
    )
    assert len(sights) == 1
    assert judge(right, pair.source, model, ()).reliable


def test_where_nothing_is_known_nothing_is_reliable():
    pair, judge = overlap(), VisibilityJudge(sensor=Sensor.known)
    views = [replace(view, scan=None) for view in (pair.source, pair.target)]
    found = TrimmedICP()(*views, pair.T_target_source)
    verdict = judge(found, *views, ())
    assert not verdict.reliable
    assert "nothing is known" in verdict.reason


def test_each_reason_to_refuse():
    pair = overlap()
    found = TrimmedICP()(pair.source, pair.target, pair.T_target_source)

    def reason(**changes):
        verdict = replace(VisibilityJudge(), **changes)(found, pair.source, pair.target, ())
        assert not verdict.reliable
        return verdict.reason

    assert reason(min_visible=0.99) == "too little is seen by both"
    assert reason(min_overlap=0.99) == "overlap below 0.99"
    assert "slide" in reason(min_localizability=1.0)


def test_a_plane_that_slides_along_another_is_refused():
    first, second = wall(name="a"), wall(name="b")
    found = TrimmedICP()(first, second, se3.from_parts(np.eye(3), np.array([4.0, 0, 0])))
    verdict = VisibilityJudge()(found, first, second, ())
    assert not verdict.reliable
    assert "slide" in verdict.reason


def test_what_floats_before_the_other_is_refused_both_ways():
    """Moved towards one sensor, the scan hides from the other: either way one of them objects."""
    pair, judge = overlap(), VisibilityJudge()
    for step in (12.0, -12.0):
        shift = step * pair.target.scale.resolution * pair.target.scan.view_direction
        pose = se3.from_parts(np.eye(3), shift) @ pair.T_target_source
        found = replace(
            TrimmedICP()(pair.source, pair.target, pair.T_target_source), T_target_source=pose
        )
        verdict = judge(found, pair.source, pair.target, ())
        assert not verdict.reliable
        assert verdict.score > 0.3


@pytest.mark.parametrize(
    "wrong", [{"reach": 0.0}, {"tolerance": -1.0}, {"tolerance": np.inf}, {"max_violation": 1.5}]
)
def test_parameters_out_of_range_are_refused_by_name(wrong):
    with pytest.raises(mvreg.InputError, match=f"^{next(iter(wrong))}: expected"):
        Visibility(**wrong)
