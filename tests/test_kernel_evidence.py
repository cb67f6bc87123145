"""The kernel of the evidence against its reference."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg import se3
from mvreg.kernels import evidence
from mvreg.kernels.reference import evidence as plain
from mvreg.kernels.tree import Tree
from mvreg.testing import overlap

quick = settings(max_examples=60, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)
sensors = st.sampled_from(["far", "near", "inside"])


def sheet(rng, count, stray):
    """Points of a bumpy sheet in any frame, and some that are far off."""
    flat = rng.uniform(-1, 1, size=(count, 2))
    points = np.column_stack([flat, 0.2 * np.sin(3 * flat).sum(axis=1)])
    points[: int(stray * count)] *= 50
    return se3.apply(se3.random(rng, 3.0), points)


def sensor_of(kind, points, rng):
    """A direction or an origin."""
    if kind == "far":
        direction = rng.normal(size=3)
        return direction / np.linalg.norm(direction), None
    return None, points.mean(axis=0) + (5.0 if kind == "near" else 0.3) * rng.normal(size=3)


@quick
@given(rngs, sensors, st.integers(1, 800), st.sampled_from([0.0, 0.02]), st.integers(1, 9),
       st.sampled_from([0.01, 0.1, 0.5, 5.0]))  # fmt: skip
def test_rays(rng, kind, count, stray, most, reach):
    seen = sheet(rng, count, stray)
    sensor = sensor_of(kind, seen, rng)
    points = seen[rng.integers(count, size=50)] + reach * rng.normal(size=(50, 3))
    found = evidence.Rays(seen, *sensor, reach).nearby(points, most)
    expected = plain.nearby(seen, *sensor, reach, points, most)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.parametrize("reach", [0.0, 1e-9, 1e9])
def test_rays_of_next_to_nothing(reach):
    up, points = np.array([0.0, 0, 1]), np.zeros((3, 3))
    for sensor in ((up, None), (None, up), (None, np.zeros(3))):
        for seen in (np.empty((0, 3)), points):
            rays = evidence.Rays(seen, *sensor, reach)
            height, low, high = rays.nearby(np.vstack([points, [[1e12, 0, 0]]]), 4)
            assert np.isfinite(height).all()
            answered = len(seen) > 0 and reach > 0
            assert np.isfinite(low[:3]).all() == np.isfinite(high[:3]).all() == answered
    with pytest.raises(ValueError, match="64 rays"):
        rays.nearby(points, 65)


@quick
@given(rngs, st.booleans(), st.sampled_from([0.0, 0.3, 3.0, 100.0]))
def test_a_look_at_a_surface(rng, oriented, shift):
    pair = overlap()
    source, target = pair.source, pair.target
    points, normals = source.points[::7], source.normals[::7]
    if not oriented:
        normals = normals * rng.choice([-1.0, 1.0], size=(len(normals), 1))
    pose, reach = pair.T_target_source.copy(), 2 * target.resolution
    pose[:3, 3] += shift * target.resolution * rng.normal(size=3)
    centre = points.mean(axis=0)
    radius = np.linalg.norm(points - centre, axis=1).max()
    rays = evidence.Rays(target.scan.points, target.scan.view_direction, None, reach / 2)
    met, near, consistent, front, sums = evidence.look(
        target.tree, target.normals, points, normals, centre, radius, pose, reach, 0.7, oriented,
        rays, 4, reach,
    )  # fmt: skip
    expected = plain.look(
        target.points, target.normals, points, normals, centre, pose, reach, 0.7, oriented
    )
    np.testing.assert_array_equal(met, expected[0])
    assert near == expected[1]
    np.testing.assert_allclose(sums, expected[2], atol=1e-9 * max(1, np.abs(expected[2]).max()))
    height, low, high = rays.nearby(se3.apply(pose, points), 4)
    assert front == (height > high + reach).sum()
    assert consistent == ((height <= high + reach) & (height >= low - reach)).sum()
    assert met.any() or shift > 50
    blind = evidence.look(
        target.tree, target.normals, points, normals, centre, radius, pose, reach, 0.7, oriented,
        None, 4, reach,
    )  # fmt: skip
    assert blind[2:4] == (0, 0)
    np.testing.assert_array_equal(blind[4], sums)


@quick
@given(rngs, st.sampled_from([0.0, 1.0, 100.0]), st.sampled_from([0.0, 0.5, 3.0]))
def test_touch(rng, shift, reach):
    pair = overlap()
    source, target = pair.source, pair.target
    pose = pair.T_target_source.copy()
    pose[:3, 3] += shift * target.resolution * rng.normal(size=3)
    some = source.points[::7], source.normals[::7], pose, reach * target.resolution, 0.7
    which, heights = evidence.touch(target.tree, target.normals, *some)
    expected = plain.touch(target.points, target.normals, *some)
    np.testing.assert_array_equal(which, expected[0])
    np.testing.assert_allclose(heights, expected[1], atol=1e-9)
    assert len(which) or shift or reach < 3


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.zeros((2, 3))])
def test_little_touches_nothing(points):
    up = np.tile([0.0, 0, 1], (len(points), 1))
    nothing = Tree(np.empty((0, 3))), np.empty((0, 3))
    assert len(evidence.touch(*nothing, points, up, np.eye(4), 1.0, 0.7)[0]) == 0
    met, *counts, sums = evidence.look(
        *nothing, points, up, np.zeros(3), 0.0, np.eye(4), 1.0, 0.7, True, None, 4, 1.0
    )
    assert counts == [0, 0, 0]
    assert not met.any() and not sums.any()


@quick
@given(rngs, st.integers(0, 200))
def test_box(rng, count):
    points, motion = rng.normal(size=(count, 3)), se3.random(rng, 10.0)
    found, expected = evidence.box(points, motion), plain.box(points, motion)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


@quick
@given(rngs, st.integers(1, 400), st.sampled_from([0.02, 0.2, 3.0]))
def test_hidden(rng, count, cell):
    points = sheet(rng, count, 0.01)
    landmark = rng.normal(size=3)
    directions = rng.normal(size=(6, 3))
    directions[0] = landmark
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = evidence.hidden(points, directions, landmark, cell, 2 * cell)
    np.testing.assert_allclose(found, plain.hidden(points, directions, landmark, cell, 2 * cell))
