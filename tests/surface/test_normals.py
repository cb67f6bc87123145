import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.geometry import se3
from mvreg.surface.normals import Orient, estimate_normals, orient
from mvreg.testing import blob_scans
from mvreg.testing.scans import sphere_directions
from mvreg.types import Scan

UP = np.array([0.0, 0.0, 1.0])
quick = settings(max_examples=25, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def sphere(**sensor):
    return Scan("sphere", 10 * sphere_directions(2000), **sensor)


@quick
@given(rngs)
def test_normals_of_a_plane_are_exact(rng):
    motion = se3.random(rng, 20.0)
    flat = np.concatenate([rng.uniform(size=(300, 2)), np.zeros((300, 1))], axis=1)
    scan = Scan("plane", flat, UP).moved(motion)
    normals = estimate_normals(scan, scan.points[:50], Orient.auto)
    np.testing.assert_allclose(normals, np.tile(motion[:3, 2], (50, 1)), atol=1e-6)


@pytest.mark.parametrize(
    ("mode", "sensor", "sign"),
    [
        (Orient.direction, {"view_direction": UP}, lambda p: np.sign(p[:, 2])),
        (Orient.point, {"view_point": np.zeros(3)}, lambda p: -np.ones(len(p))),
        (Orient.point, {"view_point": 1e6 * UP}, lambda p: np.sign(p[:, 2])),
        (Orient.origin, {}, lambda p: -np.ones(len(p))),
        (Orient.auto, {"view_point": np.zeros(3)}, lambda p: -np.ones(len(p))),
        (Orient.auto, {"view_direction": -UP}, lambda p: -np.sign(p[:, 2])),
        (
            Orient.auto,
            {"view_direction": UP, "view_point": np.zeros(3)},
            lambda p: np.sign(p[:, 2]),
        ),
    ],
)
def test_normals_of_a_sphere_point_to_the_sensor(mode, sensor, sign):
    scan = sphere(**sensor)
    points = scan.points[np.abs(scan.points[:, 2]) > 1]  # not edge-on
    normals = estimate_normals(scan, points, mode)
    np.testing.assert_allclose((normals * points).sum(axis=1) / 10, sign(points), atol=5e-3)


@pytest.mark.parametrize(
    ("mode", "sensor", "known"),
    [
        (Orient.auto, {}, False),
        (Orient.fold, {"view_direction": UP}, False),
        (Orient.direction, {"view_point": UP}, False),
        (Orient.point, {"view_direction": UP}, False),
        (Orient.auto, {"view_direction": UP}, True),
        (Orient.auto, {"view_point": UP}, True),
        (Orient.origin, {}, True),
    ],
)
@pytest.mark.parametrize("shape", [(5, 3), (5, 4, 3), (0, 4, 3)])
def test_whether_signs_mean_anything(mode, sensor, known, shape, rng):
    normals = rng.normal(size=shape)
    points = rng.normal(size=(shape[0], 3))
    found, oriented = orient(normals, points, sphere(**sensor), mode)
    assert oriented is known
    assert found.shape == shape
    np.testing.assert_array_equal(np.abs(found), np.abs(normals))
    if not known:
        np.testing.assert_array_equal(found, normals)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_points_have_some_normals(count, rng):
    points = rng.normal(size=(count, 3))
    normals = estimate_normals(Scan("few", points), points, Orient.auto)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)


def test_duplicates_have_some_normals():
    points = np.ones((30, 3))
    normals = estimate_normals(Scan("one", points, UP), points, Orient.auto)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)


def test_normals_turn_with_the_scan():
    scan = blob_scans(2).scans[0]
    motion = se3.random(np.random.default_rng(4), 50.0)
    there = scan.moved(motion)
    before = estimate_normals(scan, scan.points[::9], Orient.auto)
    after = estimate_normals(there, there.points[::9], Orient.auto)
    cosine = (after * (before @ motion[:3, :3].T)).sum(axis=1)
    assert (np.abs(cosine) > 1 - 1e-6).all()
    assert (cosine > 0).mean() > 0.99, "edge-on, rounding decides"


def test_more_neighbours_smooth_more(rng):
    scan = Scan("rough", np.column_stack([rng.uniform(0, 10, size=(3000, 2)),
                                          rng.normal(scale=0.05, size=3000)]), UP)  # fmt: skip
    middle = scan.points[np.abs(scan.points[:, :2] - 5).max(axis=1) < 3]
    few, many = (estimate_normals(scan, middle, Orient.auto, n)[:, 2].mean() for n in (6, 60))
    assert few < many < 1
    assert many > 0.995
