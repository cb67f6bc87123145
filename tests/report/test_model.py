"""The merged model has every point of the placed scans, with its attributes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mvreg
from mvreg.errors import InputError
from mvreg.evaluation.residuals import point_residuals
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree
from mvreg.report.model import INDEX, RESIDUAL, model_clouds, model_kinds
from mvreg.types import Scan, ScanSet

RNG = np.random.default_rng(2)


def pose():
    return se3.from_parts(Rotation.random(rng=RNG).as_matrix(), RNG.normal(size=3))


def unit(count):
    vectors = RNG.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def normals_of(attributes):
    return np.stack([attributes[name] for name in ("nx", "ny", "nz")], axis=1)


class Full:
    """Ten points for the two that a scan holds."""

    count = 10
    kinds = {"intensity": np.dtype(np.float32)}  # noqa: RUF012

    def __init__(self):
        self.points = RNG.normal(size=(10, 3))

    def __call__(self):
        return self.points, {"intensity": np.arange(10, dtype=np.float32)}

    def pieces(self):
        yield self()


def test_the_model():
    normals = unit(4)
    rich = Scan(
        "rich", RNG.normal(size=(4, 3)),
        attributes=dict(zip(("nx", "ny", "nz"), normals.T, strict=True))
        | {"red": np.array([0, 255, 3, 4], dtype=np.uint8)},
    )  # fmt: skip
    deep = Scan("deep", RNG.normal(size=(3, 3)), attributes={"red": np.array([1, 2, 65535], "u2")})
    full = Full()
    large = Scan("large", full.points[:2], full=full)
    lost = Scan("lost", RNG.normal(size=(5, 3)), attributes={"time": np.zeros(5)})
    first, then = pose(), pose()
    moved = rich.moved(first), deep.moved(first), large.moved(first), lost
    poses = {"rich": then, "deep": then, "large": then}
    scanset = ScanSet("some", (moved[3], *moved[:3]))
    kinds = model_kinds(scanset, poses)
    assert kinds == {
        "nx": "f8",
        "ny": "f8",
        "nz": "f8",
        "red": "u2",
        "intensity": "f4",
        INDEX: "u2",
    }
    clouds = list(model_clouds(scanset, poses))
    assert [cloud.name for cloud in clouds] == ["rich", "deep", "large"]
    both = then @ first
    for cloud, points in zip(clouds, (rich.points, deep.points, full.points), strict=True):
        np.testing.assert_allclose(cloud.points, se3.apply(both, points), atol=1e-12)
    np.testing.assert_allclose(
        normals_of(clouds[0].attributes), normals @ both[:3, :3].T, atol=1e-12
    )
    np.testing.assert_array_equal(clouds[0].attributes["red"], [0, 65535, 771, 1028])
    np.testing.assert_array_equal(clouds[1].attributes["red"], [1, 2, 65535])
    np.testing.assert_array_equal(clouds[2].attributes["intensity"], np.arange(10))
    assert [set(cloud.attributes[INDEX].tolist()) for cloud in clouds] == [{1}, {2}, {3}]


def test_that_points_chosen_keep_their_attributes():
    scan = Scan("a", np.arange(9.0).reshape(3, 3), attributes={"red": np.array([1, 2, 3])})
    np.testing.assert_array_equal(
        scan.chosen(np.array([True, False, True])).attributes["red"], [1, 3]
    )


def test_that_an_attribute_of_other_points_is_refused():
    with pytest.raises(InputError, match="scan 'a': expected attribute 'red' of 3 points, got an"):
        Scan("a", np.zeros((3, 3)), attributes={"red": np.zeros(2)})


def test_that_residuals_are_those_of_the_nearest_registration_point():
    scans = mvreg.dataset("tiny", scramble=True, rng=6)
    views = mvreg.prepare(scans)
    measured = point_residuals(scans.poses, views)
    clouds = list(model_clouds(scans, scans.poses, views))
    assert set(model_kinds(scans, scans.poses, views)) == {INDEX, RESIDUAL}
    for cloud, scan, view in zip(clouds, scans.scans, views, strict=True):
        found = cloud.attributes[RESIDUAL]
        assert len(found) == len(scan.points)
        known = np.isfinite(found)
        assert 0.3 < known.mean() < 1
        nearest = build_tree(view.points).query(scan.points)[1]
        expected = measured[scan.name][nearest.ravel()]
        np.testing.assert_allclose(found[known], expected[known], rtol=1e-6)
