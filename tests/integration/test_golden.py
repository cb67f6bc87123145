"""Whole runs on the embedded data set `tiny`: bounds on errors, not bits, as machines differ."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.evaluation.pose_errors import consistency, pose_errors
from mvreg.geometry import nearest, se3
from mvreg.testing.compare import apart, digest
from mvreg.testing.views import scaled_scan
from mvreg.types import Result, ScanSet

#: Every second point, and a twentieth: fewer than the defaults leave, to be quick.
CHANGES = {"downsample.min_points": 2000, "downsample.min_keypoints": 280}
#: Degrees and mm, of the worst scan: about twice what was found in six orders of the scans.
MAX_ANGLE, MAX_SHIFT = 1.5, 4.5


@pytest.fixture(scope="module")
def scans() -> ScanSet:
    return mvreg.dataset("tiny")


@pytest.fixture(scope="module")
def method() -> mvreg.Method:
    return mvreg.load_method("fcpma", CHANGES)


@pytest.fixture(scope="module")
def result(scans: ScanSet, method: mvreg.Method) -> Result:
    return mvreg.register(scans, method)


def assert_right(found: Result, truth: ScanSet, unit: float = 1.0) -> None:
    """All scans are placed, and none is far from where it belongs."""
    assert found.unregistered == ()
    errors = pose_errors(found.poses, truth.poses, found.reference)
    assert errors is not None
    assert len(errors.scans) == 6
    assert errors.max.angle < MAX_ANGLE
    assert errors.max.translation < MAX_SHIFT * unit


def assert_agree(found: Result, expected: Result, truth: ScanSet) -> None:
    """Both put every point in the same place to half a resolution, in the frame of the scans."""
    resolution = expected.model.scale.resolution
    for scan in truth.scans:
        pose = found.poses[scan.name]
        assert apart(pose, expected.poses[scan.name], scan.points) < resolution / 2


def test_all_scans_are_placed_with_few_pairs(scans, result):
    assert_right(result, scans)
    assert len(result.pairs) <= 3 * len(scans.scans)
    errors = pose_errors(result.poses, scans.poses, result.reference)
    assert errors.mean.rotation < 0.02
    assert errors.mean.translation < 2.0


def test_surfaces_lie_on_each_other(scans, method, result):
    views = method.pipeline.prepare(scans.scans, np.random.default_rng(0))
    found, truth = consistency(result.poses, views), consistency(scans.poses, views)
    assert found.median < 2 * truth.median
    assert found.rms < 1.5 * truth.rms


def test_the_same_call_gives_the_same_poses_bit_for_bit(scans, method, result):
    assert digest(mvreg.register(scans, method).poses) == digest(result.poses)


@pytest.mark.parametrize("workers", [1, 3])
def test_the_number_of_workers_does_not_matter(scans, method, result, workers, monkeypatch):
    monkeypatch.setattr(nearest, "FEW", 1)
    monkeypatch.setenv("OMP_NUM_THREADS", str(workers))
    assert digest(mvreg.register(scans, method).poses) == digest(result.poses)


@pytest.mark.parametrize("factor", [1e-3, 1 / 25.4])
def test_another_unit_of_length_changes_nothing(scans, method, result, factor):
    """Metres, inches: rounding differs, and with it what is drawn, but not the answer."""
    moved = [scaled_scan(scan, factor) for scan in scans.scans]
    found = mvreg.register(moved, method)
    assert found.unregistered == ()
    back = {n: se3.from_parts(p[:3, :3], p[:3, 3] / factor) for n, p in found.poses.items()}
    assert_agree(replace(found, poses=back), result, scans)


def test_a_power_of_two_as_unit_changes_not_a_bit(scans, method, result):
    factor = 1024.0
    moved = [scaled_scan(scan, factor) for scan in scans.scans]
    found = mvreg.register(moved, method)
    back = {n: se3.from_parts(p[:3, :3], p[:3, 3] / factor) for n, p in found.poses.items()}
    assert digest(back) == digest(result.poses)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_shuffled_and_scrambled_scans_are_placed_too(number, method):
    scans = mvreg.dataset("tiny", rng=number, order="shuffle", scramble=True)
    assert_right(mvreg.register(scans, method, rng=number), scans)


def test_scrambled_scans_end_where_the_others_do(scans, method, result):
    """Grids have a phase, so that the answer differs, but by less than half a resolution."""
    there = mvreg.dataset("tiny", rng=5, scramble=True)
    found = mvreg.register(there, method)
    first = result.reference
    motion = {s.name: there.poses[s.name] for s in there.scans}
    back = {
        name: se3.invert(scans.poses[first])
        @ motion[first]
        @ pose
        @ se3.invert(motion[name])
        @ scans.poses[name]
        for name, pose in found.poses.items()
    }
    assert found.unregistered == ()
    assert_agree(replace(found, poses=back), result, scans)


@pytest.mark.parametrize("name", ["auto", "ocpra", "ocpma"])
def test_the_other_methods_place_all_scans(scans, name):
    changes = {} if name == "auto" else CHANGES
    assert_right(mvreg.register(scans, name, changes=changes), scans)
