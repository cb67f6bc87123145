import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.errors import InputError
from mvreg.stages.downsample.grid import GridDownsample
from mvreg.stages.downsample.sampling import PaperDownsample, StrideDownsample, VoxelDownsample
from mvreg.stages.downsample.voxels import spacing_for_ratio, voxel_centroids
from mvreg.surface.spacing import raw_resolution
from mvreg.testing import blob_scans
from mvreg.types import Scan

quick = settings(max_examples=40, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)


@quick
@given(rngs, st.integers(1, 60), st.floats(0.05, 3))
def test_centroids_are_the_means_of_the_cells(rng, count, step):
    points = rng.normal(size=(count, 3)) * 10 ** rng.uniform(-3, 3)
    step *= np.ptp(points, axis=0).max() or 1.0
    cells: dict[tuple[int, ...], list[np.ndarray]] = {}
    for point in points:
        cell = tuple(np.floor((point - points.min(axis=0)) / step).astype(int))
        cells.setdefault(cell, []).append(point)
    expected = np.array(sorted(np.mean(cell, axis=0).tolist() for cell in cells.values()))
    found = voxel_centroids(points, step)
    np.testing.assert_allclose(found[np.lexsort(found.T[::-1])], expected, rtol=1e-9, atol=1e-12)


def test_a_fine_grid_keeps_every_point_and_a_coarse_one_the_mean(rng):
    points = rng.normal(size=(50, 3))
    assert len(voxel_centroids(points, 1e-6)) == 50
    np.testing.assert_allclose(voxel_centroids(points, 1e3), points.mean(axis=0)[None])


def test_an_outlier_far_away_costs_no_memory():
    points = np.array([[0.0, 0, 0], [0.1, 0, 0], [1e5, 1e5, 1e5]])
    assert len(voxel_centroids(points, 1.0)) == 2


@pytest.mark.parametrize("ratio", [4.0, 12.0, 40.0, 100.0])
def test_the_spacing_leaves_the_share_asked_for(ratio):
    scans = blob_scans(3).scans
    spacing = spacing_for_ratio(scans, ratio)
    left = sum(len(voxel_centroids(scan.points, spacing)) for scan in scans)
    assert sum(len(scan.points) for scan in scans) / left == pytest.approx(ratio, rel=0.1)


def test_the_spacing_grows_with_the_ratio_and_the_unit():
    scans = blob_scans(3).scans
    spacings = [spacing_for_ratio(scans, ratio) for ratio in (5, 20, 80)]
    assert spacings == sorted(spacings)
    assert spacings[0] > raw_resolution(scans)
    metres = [Scan(scan.name, scan.points / 1000) for scan in scans]
    assert spacing_for_ratio(metres, 20) == pytest.approx(spacings[1] / 1000)


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.ones((30, 3)), np.eye(3)])
def test_there_is_a_spacing_for_every_scan(points):
    spacing = spacing_for_ratio([Scan("poor", points)], 100.0)
    assert np.isfinite(spacing)
    assert spacing > 0


def test_the_paper_takes_every_tenth_point_in_file_order(rng):
    scan = Scan("s", rng.normal(size=(1005, 3)))
    (sample,), spacing = PaperDownsample(min_points=1)([scan], rng)
    np.testing.assert_array_equal(sample.points, scan.points[::10])
    np.testing.assert_array_equal(sample.keypoints, voxel_centroids(scan.points, spacing))


def test_all_scans_share_one_grid_step(rng):
    scans = blob_scans(3).scans
    fine = Scan("sparse", scans[0].points[::4])
    for stage in (PaperDownsample(), VoxelDownsample()):
        samples, spacing = stage([*scans, fine], rng)
        np.testing.assert_array_equal(
            samples[3].keypoints, voxel_centroids(fine.points, spacing), str(stage)
        )


def test_strides_are_strides(rng):
    scan = Scan("s", rng.normal(size=(1005, 3)))
    (sample,), spacing = StrideDownsample(7, 50, min_points=1, min_keypoints=1)([scan], rng)
    np.testing.assert_array_equal(sample.points, scan.points[::7])
    np.testing.assert_array_equal(sample.keypoints, scan.points[::50])
    assert spacing == spacing_for_ratio([scan], 50)


def test_voxels_are_in_units_of_the_resolution(rng):
    scans = blob_scans(3).scans
    resolution = raw_resolution(scans)
    stage = VoxelDownsample(step=3.0, keypoint_step=6.0, min_points=1, min_keypoints=1)
    samples, spacing = stage(scans, rng)
    assert spacing == pytest.approx(6 * resolution)
    for scan, sample in zip(scans, samples, strict=True):
        np.testing.assert_array_equal(sample.points, voxel_centroids(scan.points, 3 * resolution))
        np.testing.assert_array_equal(sample.keypoints, voxel_centroids(scan.points, spacing))


@pytest.mark.parametrize(
    ("stage", "parameters"),
    [
        (PaperDownsample, {"stride": 0}),
        (PaperDownsample, {"keypoint_ratio": -1.0}),
        (PaperDownsample, {"keypoint_ratio": float("nan")}),
        (StrideDownsample, {"stride": -3}),
        (StrideDownsample, {"keypoint_stride": 0}),
        (VoxelDownsample, {"step": 0.0}),
        (VoxelDownsample, {"keypoint_step": -1.0}),
        (StrideDownsample, {"min_points": 0}),
        (VoxelDownsample, {"min_keypoints": -1}),
    ],
)
def test_what_is_not_positive_is_refused_by_name(stage, parameters):
    (name,) = parameters
    with pytest.raises(InputError, match=rf"^downsample\.{name}: expected a positive number, got"):
        stage(**parameters)


@pytest.mark.parametrize("stage", [PaperDownsample(), StrideDownsample(), VoxelDownsample()])
def test_small_scans_are_thinned_out_less(rng, stage):
    scans = [rough(6000, number) for number in range(3)]
    samples, _ = stage(scans, rng)
    assert np.mean([len(sample.points) for sample in samples]) == pytest.approx(3000, rel=0.05)
    assert np.mean([len(sample.keypoints) for sample in samples]) == pytest.approx(300, rel=0.1)


@pytest.mark.parametrize("stage", [PaperDownsample(), StrideDownsample(), VoxelDownsample()])
def test_keypoints_of_the_smallest_scans_have_points_around_them(rng, stage):
    samples, _ = stage([rough(600, number) for number in range(3)], rng)
    for sample in samples:
        assert len(sample.points) > 0.9 * 600
        assert len(sample.keypoints) == pytest.approx(50, rel=0.1)


@pytest.mark.parametrize("stage", [StrideDownsample, VoxelDownsample])
def test_large_scans_are_thinned_out_as_told(rng, stage):
    scans = [rough(40_000, number) for number in range(2)]
    found, spacing = stage()(scans, rng)
    told, expected = stage(min_points=1, min_keypoints=1)(scans, rng)
    assert spacing == expected
    for mine, yours in zip(found, told, strict=True):
        np.testing.assert_array_equal(mine.points, yours.points)
        np.testing.assert_array_equal(mine.keypoints, yours.keypoints)


def rough(count, number=0):
    """A scan of `count` points on a square of 100 with a little relief."""
    rng = np.random.default_rng(number)
    flat = rng.uniform(0, 100, size=(count, 2))
    return Scan(f"s{number}", np.column_stack([flat, np.sin(flat.sum(axis=1) / 9)]))


def test_grid_keeps_as_many_of_a_large_scan_as_of_a_small_one():
    stage = GridDownsample(points=1000, keypoints=100)
    for count in (5_000, 50_000):
        (sample, _), spacing = stage([rough(count), rough(count, 1)], np.random.default_rng(0))
        assert len(sample.points) == pytest.approx(1000, rel=0.05)
        assert len(sample.keypoints) == pytest.approx(100, rel=0.1)
        assert spacing == pytest.approx(10, rel=0.15)


def test_grid_gives_a_sparse_scan_points_as_far_apart_as_the_others():
    stage = GridDownsample(points=1000, keypoints=100)
    scans = [rough(20_000), rough(20_000, 1), rough(4_000, 2)]
    samples, _ = stage(scans, np.random.default_rng(0))
    assert len(samples[2].keypoints) == pytest.approx(len(samples[0].keypoints), rel=0.1)
    assert len(samples[2].points) > 0.9 * len(samples[0].points)


def test_grid_leaves_outliers_out_and_small_scans_whole():
    stage = GridDownsample(points=1000, keypoints=100)
    rng = np.random.default_rng(5)
    scans = []
    for number in range(2):
        clean = rough(20_000, number).points
        outliers = rng.uniform([0, 0, 20], [100, 100, 120], size=(2000, 3))
        scans.append(Scan(f"s{number}", np.concatenate([clean, outliers])))
    (sample, _), _ = stage(scans, rng)
    assert (sample.points[:, 2] > 20).mean() < 0.07  # cells of two by chance
    assert (sample.keypoints[:, 2] > 20).sum() == 0
    (sample, _), _ = stage([rough(900), rough(900, 1)], rng)
    assert len(sample.points) == 900
