"""Of large scans some points are registered, and the model has all."""

from __future__ import annotations

import os

import numpy as np
import pytest

import mvreg
from mvreg.datasets.folder import Folder
from mvreg.errors import InputError
from mvreg.io import PointCloud, read_cloud, write_ply_clouds
from mvreg.report.model import INDEX
from mvreg.report.run_folder import write_model
from tests.support.large_folders import folder, write


def test_that_the_model_has_all_points_of_which_some_are_held(tmp_path):
    large, grey = write(tmp_path / "a.ply", 1000)
    small, _ = write(tmp_path / "b.ply", 100)
    scans = folder(tmp_path, 200)
    a, b = scans.scans
    assert len(a.points) == 200 and a.full is not None and a.full.count == 1000
    assert len(b.points) == 100 and b.full is None
    rows = {tuple(point) for point in large}
    assert {tuple(point) for point in a.points} <= rows
    again = folder(tmp_path, 200).scans[0]
    np.testing.assert_array_equal(again.points, a.points)
    write_model(tmp_path / "model.ply", scans, {"a.ply": np.eye(4), "b.ply": np.eye(4)})
    model = read_cloud(tmp_path / "model.ply")
    np.testing.assert_array_equal(model.points, [*large, *small])
    np.testing.assert_array_equal(model.attributes["grey"][:1000], grey)
    np.testing.assert_array_equal(model.attributes[INDEX], np.repeat([0, 1], [1000, 100]))


def test_that_the_model_of_moved_scans_is_where_their_poses_say(tmp_path):
    large, _ = write(tmp_path / "a.ply", 1000)
    write(tmp_path / "b.ply", 100)
    scans = folder(tmp_path, 200, scramble=True)
    poses = {name: np.linalg.inv(motion) for name, motion in scans.motions.items()}
    write_model(tmp_path / "model.ply", scans, {"a.ply": poses["a.ply"]})
    np.testing.assert_allclose(read_cloud(tmp_path / "model.ply").points, large, atol=1e-9)


def test_that_a_file_that_changed_meanwhile_is_told(tmp_path):
    write(tmp_path / "a.ply", 1000)
    write(tmp_path / "b.ply", 100)
    scan = folder(tmp_path, 200).scans[0]
    write(tmp_path / "a.ply", 1000)
    os.utime(tmp_path / "a.ply", ns=(1, 1))
    with pytest.raises(InputError, match=r"a\.ply: the file has changed since the run began"):
        scan.full()
    (tmp_path / "a.ply").unlink()
    with pytest.raises(InputError, match=r"a\.ply: cannot be read again for the model: No such"):
        scan.full()


def test_that_zero_is_no_limit(tmp_path):
    write(tmp_path / "a.ply", 1000)
    write(tmp_path / "b.ply", 100)
    assert [len(scan.points) for scan in folder(tmp_path, 0).scans] == [1000, 100]


def test_that_thinned_scans_are_registered(tmp_path):
    truth = mvreg.dataset("tiny", scramble=True, rng=1)
    for scan in truth.scans:
        write_ply_clouds(tmp_path / f"{scan.name}.ply", [PointCloud(scan.points)], {})
    thinned = Folder(path=str(tmp_path), most_points=3000)(np.random.default_rng(0))
    result = mvreg.register(thinned)
    assert len(result.poses) == 6
