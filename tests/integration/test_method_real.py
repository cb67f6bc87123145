"""FCPMA on real scans; skipped, loudly, where MVREG_DATA does not say where they are.

Bounds on e_R are twice the paper's: 0.0130 for the Bunny, 0.0380 for the Dragon, 0.0450 for the
Buddha. Five degrees off is a wrong pose.
"""

from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg.evaluation.pose_errors import PoseErrors, pose_errors
from mvreg.geometry import se3
from mvreg.io import read_points
from mvreg.testing.compare import apart
from mvreg.types import Result, ScanSet

WRONG = 5.0


def errors_of(result: Result, scans: ScanSet) -> PoseErrors:
    """The errors of a run that placed every scan, none of them wrong."""
    assert result.unregistered == ()
    found = pose_errors(result.poses, scans.poses, result.reference)
    assert found is not None
    assert len(found.scans) == len(scans.scans)
    assert found.max.angle < WRONG
    return found


@pytest.fixture(scope="module")
def bunny(data_root: Path) -> ScanSet:
    return mvreg.dataset("bunny", root=str(data_root))


@pytest.fixture(scope="module")
def in_file_order(bunny: ScanSet) -> Result:
    return mvreg.register(bunny, "fcpma")


def test_bunny_in_file_order(bunny: ScanSet, in_file_order: Result) -> None:
    errors = errors_of(in_file_order, bunny)
    assert errors.mean.rotation <= 0.0130
    assert errors.mean.translation <= 0.75
    assert len(in_file_order.pairs) <= 2 * len(bunny.scans)


def test_auto_places_the_bunny(bunny: ScanSet) -> None:
    assert errors_of(mvreg.register(bunny, "auto"), bunny).mean.rotation <= 0.0130


def test_bunny_in_metres_ends_where_bunny_in_millimetres_does(
    data_root: Path, bunny: ScanSet, in_file_order: Result
) -> None:
    metres = mvreg.dataset("bunny", root=str(data_root), unit_per_metre=1.0)
    found = mvreg.register(metres, "fcpma")
    errors_of(found, metres)
    resolution = in_file_order.model.scale.resolution
    for scan in bunny.scans:
        pose = found.poses[scan.name]
        pose = se3.from_parts(pose[:3, :3], 1000 * pose[:3, 3])
        assert apart(pose, in_file_order.poses[scan.name], scan.points) < resolution / 2


@pytest.mark.parametrize("number", [1, 2])
def test_bunny_shuffled_and_scrambled(data_root: Path, number: int) -> None:
    """Single orders may be worse than the mean over ten, for which the bounds are meant."""
    scans = mvreg.dataset("bunny", rng=number, root=str(data_root), order="shuffle", scramble=True)
    result = mvreg.register(scans, "fcpma", rng=number)
    assert errors_of(result, scans).mean.rotation <= 0.0195
    assert len(result.pairs) <= 3 * len(scans.scans)


def test_a_scan_with_stray_words_in_its_header(data_root: Path, tmp_path: Path) -> None:
    """Among its neighbours, in a folder that knows no sensor and no truth."""
    (odd,) = (data_root / "odd").glob("*.ply")
    dragon = data_root / "dragon_stand"
    for name in ("dragonStandRight_0.ply", "dragonStandRight_48.ply"):
        (tmp_path / name).symlink_to(dragon / name)
    (tmp_path / "dragonStandRight_24.ply").symlink_to(odd)
    scans = mvreg.dataset(
        "folder", path=str(tmp_path), ground_truth=str(dragon / "dragonStandRight.conf")
    )
    np.testing.assert_array_equal(
        scans.scans[1].points, read_points(dragon / "dragonStandRight_24.ply")
    )
    assert [len(scan.points) > 10_000 for scan in scans.scans] == [True] * 3
    errors_of(mvreg.register(scans, "fcpma"), scans)


@pytest.mark.parametrize(("name", "bound"), [("dragon", 0.0380), ("buddha", 0.0450)])
def test_dragon_and_buddha_in_file_order(data_root: Path, name: str, bound: float) -> None:
    scans = mvreg.dataset(name, root=str(data_root))
    result = mvreg.register(scans, "fcpma")
    assert errors_of(result, scans).mean.rotation <= bound
    assert len(result.pairs) <= 2 * len(scans.scans)
