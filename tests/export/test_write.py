"""What a program writes of a result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.errors import InputError
from mvreg.export.poses.matrices import read_matrices
from mvreg.io import read_cloud


@pytest.fixture(scope="module")
def registered():
    scans = mvreg.dataset("tiny", scramble=True)
    return scans, mvreg.register({scan.name: scan.points for scan in scans.scans})


def test_that_a_result_is_written_as_a_run_is_exported(registered, tmp_path):
    scans, result = registered
    assert mvreg.write(result, tmp_path / "out", ["matrices", "ply"]) == []
    poses = read_matrices(tmp_path / "out")
    for name, pose in result.poses.items():
        np.testing.assert_allclose(poses[name], pose, atol=1e-12)
    cloud = read_cloud(tmp_path / "out" / "model.ply")
    assert len(cloud.points) == sum(len(scan.points) for scan in scans.scans)
    assert "residual" in cloud.attributes


def test_that_what_it_lacks_is_told(registered, tmp_path):
    _, result = registered
    with pytest.raises(InputError, match=r"no format 'plz'; did you mean ply\?"):
        mvreg.write(result, tmp_path, ["plz"])
    with pytest.raises(InputError, match=r"^mvreg.write: expected a result with its views"):
        mvreg.write(replace(result, views=()), tmp_path, "ply")
