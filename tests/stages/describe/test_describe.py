import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.errors import InputError
from mvreg.stages.describe.spectrum import (
    EigenvaluesDescribe,
    SpectrumDescribe,
    neighbourhood_moments,
)
from mvreg.surface.normals import Orient
from mvreg.types import Scan

UP = np.array([0.0, 0.0, 1.0])
quick = settings(max_examples=25, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def plane(side=40, step=0.5):
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), [0]), axis=-1).reshape(-1, 3)
    return Scan("plane", grid * step, UP)


def middle(scan, reach=3.0):
    """Keypoints whose neighbourhoods the border does not cut."""
    inside = np.abs(scan.points - scan.points.mean(axis=0)).max(axis=1) < reach
    return scan.points[inside][::7]


@quick
@given(rngs, st.integers(1, 4))
def test_moments_are_sums_over_the_neighbours(rng, stride):
    scan = Scan("s", rng.normal(size=(80, 3)))
    keypoints, radii = rng.normal(size=(6, 3)), np.array([0.4, 0.9, 1.7])
    count, first, second = neighbourhood_moments(scan, keypoints, radii, stride)
    for k, keypoint in enumerate(keypoints):
        offsets = scan.points[::stride] - keypoint
        for scale, radius in enumerate(radii):
            near = offsets[np.linalg.norm(offsets, axis=1) <= radius]
            assert count[k, scale] == len(near)
            np.testing.assert_allclose(first[k, scale], near.sum(axis=0), atol=1e-9)
            np.testing.assert_allclose(second[k, scale], near.T @ near, atol=1e-9)


def test_a_plane_looks_alike_at_all_scales():
    scan = plane()
    found = SpectrumDescribe()(scan, middle(scan), 4.0)
    assert found.descriptors.shape == (len(found.keypoints), 9)
    assert np.abs(found.descriptors).max() < 0.05
    np.testing.assert_allclose(found.normals, np.broadcast_to(UP, found.normals.shape), atol=1e-9)
    assert found.oriented


def test_spectra_are_normalised_so_that_differences_sum_to_zero(rng):
    scan = Scan("rough", rng.normal(size=(2000, 3)))
    found = SpectrumDescribe(scales=5)(scan, scan.points[:50], 1.0)
    assert found.descriptors.shape == (len(found.keypoints), 12)
    blocks = found.descriptors.reshape(len(found.keypoints), 4, 3)
    np.testing.assert_allclose(blocks.sum(axis=2), 0, atol=1e-12)
    assert np.abs(blocks).max() <= 1


def test_the_spectrum_by_hand():
    """A cross of points whose covariance about the keypoint is diagonal."""
    arms = np.concatenate([a * np.diag([1.0, 0.5, 0.1]) for a in (1, -1)])
    near, far = 0.8 * arms, 1.6 * np.concatenate([d * np.eye(3) for d in (1, -1)])
    scan = Scan("cross", np.concatenate([near, near, far]))
    found = SpectrumDescribe(scales=2, min_neighbours=6)(scan, np.zeros((1, 3)), 2.0)
    first = np.array([1, 0.25, 0.01]) / 1.26
    sums = 0.64 * 4 * np.array([1, 0.25, 0.01]) + 2 * 2.56
    second = sums / sums.sum()
    np.testing.assert_allclose(found.descriptors[0], second - first, atol=1e-12)
    np.testing.assert_allclose(np.abs(found.normals[0, :, 2]), 1)


def test_eigenvalues_keep_the_size():
    scan = plane()
    found = EigenvaluesDescribe(stride=1)(scan, middle(scan), 3.0)
    assert found.descriptors.shape == (len(found.keypoints), 12)
    assert found.normals.shape == (len(found.keypoints), 1, 3)
    blocks = found.descriptors.reshape(-1, 4, 3)
    # A disc of radius r has variance r^2 / 4 along two axes and none along the third.
    np.testing.assert_allclose(blocks[..., :2], 0.5, atol=0.08)
    np.testing.assert_allclose(blocks[..., 2], 0, atol=1e-6)


@pytest.mark.parametrize("stage", [SpectrumDescribe(), EigenvaluesDescribe(stride=1)])
def test_keypoints_with_few_neighbours_are_left_out(stage):
    scan = plane(side=10)
    there = np.concatenate([scan.points[44:46], scan.points[:1] + 100])
    found = stage(scan, there, 6.0)
    np.testing.assert_array_equal(found.keypoints, there[:2])


def test_the_least_number_of_neighbours_is_the_least():
    points = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)]) * 0.1
    for least, left in [(7, 1), (8, 0)]:
        stage = SpectrumDescribe(min_neighbours=least)
        assert len(stage(Scan("few", points), np.zeros((1, 3)), 1.0).keypoints) == left


@pytest.mark.parametrize("stage", [SpectrumDescribe, EigenvaluesDescribe])
def test_normals_point_where_they_are_told(stage):
    scan = plane()
    below = Scan("plane", scan.points, -UP)
    unknown = Scan("plane", scan.points)
    for given_scan, orient, sign, oriented in [
        (scan, Orient.auto, 1, True),
        (below, Orient.auto, -1, True),
        (below, Orient.fold, 0, False),
        (unknown, Orient.auto, 0, False),
    ]:
        found = stage(orient=orient)(given_scan, middle(scan), 4.0)
        assert found.oriented is oriented
        if sign:
            np.testing.assert_allclose(found.normals[..., 2], sign)


@pytest.mark.parametrize(
    ("stage", "parameters"),
    [
        (SpectrumDescribe, {"scales": 1}),
        (EigenvaluesDescribe, {"radii": []}),
        (EigenvaluesDescribe, {"radii": [1.0, 0.5]}),
        (EigenvaluesDescribe, {"radii": [0.0, 0.5]}),
    ],
)
def test_wrong_scales_are_refused(stage, parameters):
    with pytest.raises(InputError, match=r"describe\.(scales|radii): expected"):
        stage(**parameters)
