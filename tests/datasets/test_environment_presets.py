"""Recorded places: folders below the one that MVREG_DATA names."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg.datasets.folder import Folder
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io import write_ply

SETS = {"rgbd_desk": (5, "user"), "lidar_campus": (20, "user"), "tls_office": (3, "unknown")}


@pytest.mark.parametrize("name", SETS)
def test_they_are_there_with_the_truth_in_metres(data_root: Path, name: str) -> None:
    count, told = SETS[name]
    found = mvreg.dataset(name, scramble=True)
    assert (found.name, found.unit, len(found.scans)) == (name, "m", count)
    assert found.poses is not None
    assert set(found.poses) == {scan.name for scan in found.scans}
    assert {found.sensor_of(scan) for scan in found.scans} == {told}
    for scan in found.scans:
        assert 2 < np.ptp(scan.points, axis=0).max() < 250
        if told == "user":
            np.testing.assert_allclose(scan.view_point, found.motions[scan.name][:3, 3])


@pytest.mark.parametrize("name", SETS)
def test_without_the_folder_it_says_which_one_is_wanted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.delenv("MVREG_DATA", raising=False)
    expected = rf"^dataset={name} is not on this machine: .* environments/{name} in .* MVREG_DATA "
    with pytest.raises(InputError, match=expected + r".*is not set.*dataset\.path.*figurine"):
        mvreg.dataset(name)
    monkeypatch.setenv("MVREG_DATA", str(tmp_path))
    with pytest.raises(InputError, match=expected + rf".*is '{tmp_path}' and has none"):
        mvreg.dataset(name)


def test_a_path_in_a_named_folder_and_one_in_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    points = {f"{name}.ply": rng.normal(size=(9, 3)) for name in "ab"}
    for name, each in points.items():
        write_ply(tmp_path / "above/place" / name, each)
    pose = se3.random(rng, 2.0)
    (tmp_path / "above/place/poses.json").write_text(json.dumps({"b.ply": pose.tolist()}))
    monkeypatch.setenv("ABOVE", str(tmp_path / "above"))
    given = {"ground_truth": "poses.json", "path_in": "ABOVE"}
    for path in ("place", str(tmp_path / "above/place")):
        found = Folder(path=path, **given)(rng)
        assert (found.name, [scan.name for scan in found.scans]) == ("place", list(points))
        assert found.poses is not None
        np.testing.assert_allclose(found.poses["b.ply"], pose, atol=1e-12)
        monkeypatch.delenv("ABOVE", raising=False)  # what is named in full needs no other name
