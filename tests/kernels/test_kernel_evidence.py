"""The kernel of the evidence against its reference."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.geometry import se3
from mvreg.kernels import evidence, hidden
from mvreg.kernels import overlap as surfaces
from mvreg.kernels.rays import Rays
from mvreg.kernels.tree import Tree
from mvreg.testing import overlap
from mvreg.testing.reference import evidence as plain

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
    found = Rays(seen, *sensor, reach).nearby(points, most)
    expected = plain.nearby(seen, *sensor, reach, points, most)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.parametrize("reach", [0.0, 1e-9, 1e9])
def test_rays_of_next_to_nothing(reach):
    up, points = np.array([0.0, 0, 1]), np.zeros((3, 3))
    for sensor in ((up, None), (None, up), (None, np.zeros(3))):
        for seen in (np.empty((0, 3)), points):
            rays = Rays(seen, *sensor, reach)
            height, low, high = rays.nearby(np.vstack([points, [[1e12, 0, 0]]]), 4)
            assert np.isfinite(height).all()
            answered = len(seen) > 0 and reach > 0
            assert np.isfinite(low[:3]).all() == np.isfinite(high[:3]).all() == answered
    with pytest.raises(ValueError, match="64 rays"):
        rays.nearby(points, 65)


@quick
@given(rngs, st.booleans(), st.sampled_from([0.0, 0.3, 3.0, 100.0]))
def test_evidence_at_a_surface(rng, oriented, shift):
    pair = overlap()
    source, target = pair.source, pair.target
    points, normals = source.points[::7], source.normals[::7]
    if not oriented:
        normals = normals * rng.choice([-1.0, 1.0], size=(len(normals), 1))
    pose, reach = pair.T_target_source.copy(), 2 * target.resolution
    pose[:3, 3] += shift * target.resolution * rng.normal(size=3)
    centre = points.mean(axis=0)
    radius = np.linalg.norm(points - centre, axis=1).max()
    rays = Rays(target.scan.points, target.scan.view_direction, None, reach / 2)
    met, near, consistent, front, *sums = evidence.directed_evidence(
        target.tree, target.normals, points, normals, centre, radius, pose, reach, 0.7, oriented,
        rays, 4, reach, 0.0,
    )  # fmt: skip
    sums = np.concatenate([np.ravel(one) for one in sums])
    expected = plain.directed_evidence(
        target.points, target.normals, points, normals, centre, pose, reach, 0.7, oriented
    )
    np.testing.assert_array_equal(met, expected[0])
    assert near == expected[1]
    np.testing.assert_allclose(sums, expected[2], atol=1e-9 * max(1, np.abs(expected[2]).max()))
    assert (front, consistent) == plain.before_and_on(
        target.scan.points, target.scan.view_direction, None, reach / 2, se3.apply(pose, points),
        normals @ pose[:3, :3].T, 4, reach,
    )  # fmt: skip
    assert met.any() or shift > 1
    blind = evidence.directed_evidence(
        target.tree, target.normals, points, normals, centre, radius, pose, reach, 0.7, oriented,
        None, 4, reach, 0.0,
    )  # fmt: skip
    assert blind[2:4] == (0, 0)
    np.testing.assert_array_equal(np.concatenate([np.ravel(one) for one in blind[4:]]), sums)


def ball(points):
    """Centre and radius of a ball around points."""
    centre = points.mean(axis=0)
    return centre, float(np.linalg.norm(points - centre, axis=1).max())


def may_overlap(centre, radius, rays, other_centre, other_radius, other_rays, pose, reach):
    """Of one still scan, which is asked for between two that are far away."""
    far = se3.from_parts(np.eye(3), np.array([1e4, 0, 0]))
    found = evidence.which_may_overlap(
        centre, radius, rays, reach / 2, np.stack([other_centre] * 3), np.full(3, other_radius),
        [None, other_rays, None], np.full(3, reach), np.stack([far @ pose, pose, far @ pose]),
    )  # fmt: skip
    if rays is None:
        assert not found[0] and not found[2]
    return bool(found[1])


@quick
@given(rngs, sensors, sensors, st.sampled_from([0.0, 1.0, 4.0, 20.0]))
def test_scans_that_may_not_meet_show_nothing_of_each_other(rng, kind, other_kind, shift):
    moving, still = sheet(rng, 150, 0.0), sheet(rng, 150, 0.0)
    pose = se3.random(rng, 1.0)
    pose[:3, 3] = still.mean(axis=0) - pose[:3, :3] @ moving.mean(axis=0)
    pose[:3, 3] += shift * rng.normal(size=3)
    own, other = sensor_of(kind, moving, rng), sensor_of(other_kind, still, rng)
    if may_overlap(
        *ball(moving), Rays(moving, *own, 0.2),
        *ball(still), Rays(still, *other, 0.2), pose, 0.3,
    ):  # fmt: skip
        return
    there, here = se3.apply(pose, moving), se3.apply(se3.invert(pose), still)
    assert np.linalg.norm(there[:, None] - still[None], axis=2).min() > 0.3
    assert np.isnan(plain.nearby(still, *other, 0.2, there, 4)[1]).all()
    assert np.isnan(plain.nearby(moving, *own, 0.2, here, 4)[1]).all()


def test_only_what_is_near_or_in_a_picture_may_meet():
    points = np.random.default_rng(0).uniform(-1, 1, size=(300, 3))
    near = Rays(points, None, np.array([0.0, 0, 10]), 0.1)
    far = Rays(points, np.array([0.0, 0, 1]), None, 0.1)
    for rays in (near, far, None):
        for place, may in (([0, 0, 5], rays is not None), ([9, 0, 0], False), ([0.5, 0, 0], True)):
            pose = se3.from_parts(np.eye(3), np.array(place, dtype=float))
            one, other = (*ball(points), None), (*ball(points), rays)
            assert may_overlap(*one, *other, pose, 0.1) == may
            assert may_overlap(*other, *one, se3.invert(pose), 0.1) == may
    among = se3.from_parts(np.eye(3), np.array([0.0, 0, 10]))  # the points are all about the sensor
    assert may_overlap(*ball(points), None, *ball(points), near, among, 0.1)


@quick
@given(rngs, sensors, st.sampled_from([0.0, 1.0, 4.0]))
def test_evidence_into_any_picture(rng, kind, shift):
    seen, points = sheet(rng, 200, 0.02), sheet(rng, 100, 0.0)
    pose = se3.random(rng, 1.0)
    pose[:3, 3] = seen[4:].mean(axis=0) - pose[:3, :3] @ points.mean(axis=0)
    pose[:3, 3] += shift * rng.normal(size=3)
    sensor = sensor_of(kind, seen, rng)
    nothing = Tree(np.empty((0, 3))), np.empty((0, 3))
    normals = rng.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    _, _, consistent, front, *_ = evidence.directed_evidence(
        *nothing, points, normals, *ball(points), pose, 0.1, 0.7, True,
        Rays(seen, *sensor, 0.2), 4, 0.1, 0.0,
    )  # fmt: skip
    assert (front, consistent) == plain.before_and_on(
        seen, *sensor, 0.2, se3.apply(pose, points), normals @ pose[:3, :3].T, 4, 0.1
    )


def test_no_point_floats_that_is_on_what_stands_beside_it():
    steps = np.arange(-0.5, 0.5, 0.01)
    x, y = (each.ravel() for each in np.meshgrid(steps, steps))
    seen = np.column_stack([x, y, np.where(x < 0, 1.0, 0.0)])  # a step down, seen from above
    rays = Rays(seen, np.array([0.0, 0, 1]), None, 0.2)
    points = np.array([[0.03, y, 1.0] for y in (-0.2, 0.0, 0.2)])
    nothing = Tree(np.empty((0, 3))), np.empty((0, 3))
    for edge, beside in ((0.0, 3), (0.02, 3), (0.05, 0)):
        seen_before = evidence.directed_evidence(
            *nothing, points, np.tile([0.0, 0, 1], (3, 1)), *ball(points), np.eye(4), 0.1, 0.7,
            True, rays, 4, 0.1, edge,
        )  # fmt: skip
        assert (seen_before.front, seen_before.consistent) == (beside, 3 - beside)


@pytest.mark.parametrize("sensor", [(None, np.array([0.0, 0, 1])), (np.array([0, 0.6, 0.8]), None)])
def test_ground_between_two_rings_does_not_float(sensor):
    steps = np.arange(-3, 3, 0.02)
    rings = [np.column_stack([steps, np.full_like(steps, y), 0 * steps]) for y in (5.0, 8.0, 12.0)]
    points = np.array([[x, y, 0.0] for x in (-1, 0, 1) for y in (5.5, 6.3, 9.0, 10.1)])
    up, forward = (np.tile(normal, (len(points), 1)) for normal in ([0.0, 0, 1], [0.0, -1, 0]))
    nothing, rays = (Tree(np.empty((0, 3))), np.empty((0, 3))), Rays(np.vstack(rings), *sensor, 9.0)
    for normals, floats in ((up, False), (forward, True)):
        seen = evidence.directed_evidence(
            *nothing, points, normals, *ball(points), np.eye(4), 0.1, 0.7, True, rays, 4, 0.1, 0.0
        )
        assert (seen.front > 0) == floats


@quick
@given(rngs, st.sampled_from([0.0, 1.0, 100.0]), st.sampled_from([0.0, 0.5, 3.0]))
def test_touch(rng, shift, reach):
    pair = overlap()
    source, target = pair.source, pair.target
    pose = pair.T_target_source.copy()
    pose[:3, 3] += shift * target.resolution * rng.normal(size=3)
    some = source.points[::7], source.normals[::7], pose, reach * target.resolution, 0.7
    which, heights = surfaces.contact_heights(target.tree, target.normals, *some)
    expected = plain.contact_heights(target.points, target.normals, *some)
    np.testing.assert_array_equal(which, expected[0])
    np.testing.assert_allclose(heights, expected[1], atol=1e-9)
    assert len(which) or shift or reach < 3


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.zeros((2, 3))])
def test_little_touches_nothing(points):
    up = np.tile([0.0, 0, 1], (len(points), 1))
    nothing = Tree(np.empty((0, 3))), np.empty((0, 3))
    assert len(surfaces.contact_heights(*nothing, points, up, np.eye(4), 1.0, 0.7)[0]) == 0
    met, *found = evidence.directed_evidence(
        *nothing, points, up, np.zeros(3), 0.0, np.eye(4), 1.0, 0.7, True, None, 4, 1.0, 0.0
    )
    assert not met.any() and not any(np.any(one) for one in found)


@quick
@given(rngs, st.integers(0, 200))
def test_box(rng, count):
    points, motion = rng.normal(size=(count, 3)), se3.random(rng, 10.0)
    found, expected = surfaces.box(points, motion), plain.box(points, motion)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_a_motion_has_four_rows_and_columns():
    with pytest.raises(ValueError, match=r"expected a motion \(4, 4\), got \(3, 3\)"):
        surfaces.box(np.zeros((2, 3)), np.eye(3))


@quick
@given(rngs, st.integers(1, 400), st.sampled_from([0.02, 0.2, 3.0]))
def test_hidden(rng, count, cell):
    points = sheet(rng, count, 0.01)
    landmark = rng.normal(size=3)
    directions = rng.normal(size=(6, 3))
    directions[0] = landmark
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found = hidden.hidden(points, directions, landmark, cell, 2 * cell)
    np.testing.assert_allclose(found, plain.hidden(points, directions, landmark, cell, 2 * cell))
