"""Solids, and what rays meet of them."""

import numpy as np
import pytest

from mvreg.datasets.environments.build import ball, between, box, pillar, prism, put, tube, wall
from mvreg.datasets.environments.scene import Scene, moved
from mvreg.geometry import se3

SOLIDS = {
    "box": box((1.0, 2.0, 0.5), (0.3, -0.2, 1.0), turn=30, tilt=20),
    "prism": put([prism([(0, 0), (2, 0), (1, 1)], 3.0)], 0.5, 1.0, 0.2, turn=40)[0],
    "tube": tube((0, 0, 0), (1, 2, 0.5), 0.4),
    "pillar": pillar(0.5, 1.2, (1, 1, -0.3)),
    "ball": ball((0.5, 1.0, 0.3), (0.2, 0.1, 0.5), turn=25),
}


def fan(count=3000, seed=3):
    rays = np.random.default_rng(seed).normal(size=(count, 3))
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def traced(scene, start, rays, farthest=30.0):
    """Ranges by walking along the rays as far as the clearance says that nothing is there."""
    ranges = np.zeros(len(rays))
    for _ in range(4000):
        steps = scene.clearance(start + ranges[:, None] * rays)
        ranges += np.where(ranges < farthest, np.maximum(steps, 0), 0)
        if (steps[ranges < farthest] < 1e-7).all():
            break
    return np.where(ranges < farthest, ranges, np.inf)


@pytest.mark.parametrize("name", SOLIDS)
def test_rays_end_on_the_surface_where_walking_along_them_does(name):
    scene = Scene((SOLIDS[name],))
    start = np.array([3.0, -2.5, 1.7])
    aim = SOLIDS[name].pose[:3, 3] - start + 0.8 * np.random.default_rng(0).normal(size=(3000, 3))
    rays = aim / np.linalg.norm(aim, axis=1, keepdims=True)
    ranges, cosines = scene.cast(start, rays)
    hit = np.isfinite(ranges)
    assert 0.1 < hit.mean() < 0.98
    assert np.abs(scene.clearance(start + ranges[hit, None] * rays[hit])).max() < 1e-9
    walked = traced(scene, start, rays)
    same = np.isclose(walked, ranges, atol=1e-4) | (np.isinf(walked) & np.isinf(ranges))
    assert same.mean() > 0.995  # but for rays that all but touch it
    assert (cosines[hit] >= 0).all() and (cosines[hit] <= 1 + 1e-9).all()


@pytest.mark.parametrize("name", SOLIDS)
def test_cosines_are_those_of_the_surface(name):
    """The range of a ray beside says how the surface is inclined."""
    solid = SOLIDS[name]
    start = np.array([3.0, -2.5, 1.7])
    middle = (solid.pose[:3, 3] - start) / np.linalg.norm(solid.pose[:3, 3] - start)
    side = np.cross(middle, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    rays = np.array([middle, middle + 1e-5 * side, middle + 1e-5 * np.cross(middle, side)])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    ranges, cosines = solid.meet(start, rays)
    points = start + ranges[:, None] * rays
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    assert cosines[0] == pytest.approx(abs(normal @ middle) / np.linalg.norm(normal), abs=1e-4)


def test_clearances_are_distances_where_they_can_be_told_by_hand():
    cube, rod, egg = (
        between((0, 0, 0), (2, 2, 2)),
        pillar(1, 2, (0, 0, 0)),
        ball((1, 1, 1), (0, 0, 0)),
    )
    assert cube.clearance(np.array([[3.0, 1, 1], [1, 1, 1], [1, 1, 2]])) == pytest.approx(
        [1, -1, 0]
    )
    assert rod.clearance(np.array([[3.0, 0, 1], [0, 0, 2.5], [0, 0, 1]])) == pytest.approx(
        [2, 0.5, -1]
    )
    assert egg.clearance(np.array([[3.0, 0, 0], [0, 0, 0.5]])) == pytest.approx([2, -0.5])


def test_a_scene_shows_what_is_in_front():
    start, ahead = np.zeros(3), np.array([[1.0, 0, 0]])
    near, far = box((1, 1, 1), (3, 0, -0.5)), box((1, 9, 9), (6, 0, -4.5))
    assert Scene((far, near)).cast(start, ahead)[0] == pytest.approx([2.5])
    assert Scene((near, far)).cast(start, ahead)[0] == pytest.approx([2.5])
    assert np.isinf(Scene((near, far)).cast(start, -ahead)[0]).all()
    assert np.isinf(Scene((near, far)).cast(start, ahead, farthest=2.4)[0]).all()


def test_what_is_not_looked_at_in_bundles_is_not_missed():
    """All rays against all solids, whatever is left out for speed."""
    rng = np.random.default_rng(1)
    solids = [solid for x, y in rng.uniform(-9, 9, (8, 2)) for solid in put(SOLIDS.values(), x, y)]
    start, rays = np.array([0.0, 0, 12]), fan()
    ranges, _ = Scene(tuple(solids)).cast(start, rays)
    every = np.min([solid.meet(start, rays)[0] for solid in solids], axis=0)
    assert np.isfinite(every).any()
    assert np.array_equal(ranges, every)


def test_solids_move_as_points_do():
    motion = se3.random(np.random.default_rng(0), shift=3)
    points = np.random.default_rng(1).uniform(-3, 3, (50, 3))
    for before, after in zip(SOLIDS.values(), moved(SOLIDS.values(), motion), strict=True):
        assert np.allclose(after.clearance(se3.apply(motion, points)), before.clearance(points))


def test_a_wall_has_its_openings_and_windows_a_pane():
    pieces = Scene(tuple(wall((0, 0), (6, 0), 3.0, [(1, 2, 0, 2.1), (3, 4, 0.9, 2.2)], 0.2)))

    def behind(x, z):
        return pieces.cast(np.array([x, -1.0, z]), np.array([[0.0, 1, 0]]))[0][0]

    assert behind(0.5, 1) == behind(2.5, 1) == behind(5, 1) == pytest.approx(1)
    assert np.isinf(behind(1.5, 1)) and behind(1.5, 2.5) == pytest.approx(1)
    assert behind(3.5, 1.5) == pytest.approx(1.16)
    assert behind(3.5, 0.5) == behind(3.5, 2.6) == pytest.approx(1)
