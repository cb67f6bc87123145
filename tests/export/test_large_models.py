"""Scans of which a part is held are exported in pieces, and as if all of them had been held."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from mvreg.datasets.folder import Folder
from mvreg.datasets.large import StoredPoints
from mvreg.export.model import Model
from mvreg.export.placements import Component, Placements
from mvreg.export.table import BY_NAME
from mvreg.geometry import se3
from mvreg.io import PointCloud, read_clouds, write_ply_clouds
from mvreg.io.cloud_stream import Probes, some_of, spacing_of
from mvreg.io.las_write import write_las_clouds

COLOURS = ("red", "green", "blue")
NAMES = ("a.laz", "b.ply", "c.las")


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    rng = np.random.default_rng(0)
    for name in NAMES:
        points = rng.normal(size=(5000, 3)).round(4)
        attributes = {colour: rng.integers(0, 256, 5000).astype("u1") for colour in COLOURS}
        attributes["intensity"] = rng.integers(0, 4000, 5000).astype("u2")
        cloud = PointCloud(points, attributes=attributes)
        kinds = {key: values.dtype for key, values in attributes.items()}
        path = tmp_path / "scans" / name
        (write_ply_clouds if path.suffix == ".ply" else write_las_clouds)(path, [cloud], kinds)
    return tmp_path / "scans"


def model(folder: Path, most: int, names: Sequence[str] = NAMES) -> Model:
    scanset = Folder(path=str(folder), most_points=most)(np.random.default_rng(0))
    rng = np.random.default_rng(1)
    poses = {name: se3.random(rng, shift=2.0) for name in names}
    one = Component(1, names[0], poses, ())
    return Model(scanset, one, Placements(names, (one,), (), 0.01))


@pytest.mark.parametrize("name", ["ply", "pcd", "las", "laz", "e57", "ptx", "scans"])
def test_that_the_files_are_the_same(
    scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    if name == "e57":
        pytest.importorskip("pye57", reason="NOT TESTED: pye57 is not installed")
    write = BY_NAME[name].write
    said = write(tmp_path / "whole", model(scans, 0))  # type: ignore[arg-type]

    def whole(self: StoredPoints) -> None:
        raise AssertionError("all points of a scan were asked for at once")

    monkeypatch.setattr(StoredPoints, "__call__", whole)
    monkeypatch.setattr("mvreg.io.pieces.ROWS", 700)
    monkeypatch.setattr("mvreg.io.las.CHUNK", 700)
    thin = model(scans, 300)
    assert all(scan.full is not None and len(scan.points) == 300 for scan in thin.scanset.scans)
    (tmp_path / "pieces").mkdir()
    assert write(tmp_path / "pieces", thin) == said  # type: ignore[arg-type]
    files = [path for path in (tmp_path / "whole").rglob("*.*") if path.is_file()]
    assert len(files) == (3 if name in ("ptx", "scans") else 1)
    for file in files:
        other = tmp_path / "pieces" / file.relative_to(tmp_path / "whole")
        for one, again in zip(read_clouds(file), read_clouds(other), strict=True):
            np.testing.assert_allclose(one.points, again.points, atol=1e-12)
            assert list(one.attributes) == list(again.attributes)
            for key, values in one.attributes.items():
                assert values.dtype == again.attributes[key].dtype
                np.testing.assert_array_equal(values, again.attributes[key])
            np.testing.assert_array_equal(one.T_world_scan, again.T_world_scan)


@pytest.mark.parametrize("known", [False, True])
def test_that_intensities_are_looked_for_only_where_there_are_some(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, known: bool
) -> None:
    values = {"intensity": np.arange(5000.0)} if known else {}
    cloud = PointCloud(np.random.default_rng(0).normal(size=(5000, 3)), attributes=values)
    kinds = {key: each.dtype for key, each in values.items()}
    for name in NAMES:
        write_ply_clouds(tmp_path / "scans" / f"{name}.ply", [cloud], kinds)
    thin = model(tmp_path / "scans", 300, [f"{name}.ply" for name in NAMES])
    read, pieces = [], StoredPoints.pieces
    monkeypatch.setattr(StoredPoints, "pieces", lambda one: read.append(one) or pieces(one))
    BY_NAME["ptx"].write(tmp_path, thin)  # type: ignore[arg-type]
    assert len(read) == len(NAMES) * (1 + known)
    for file in (tmp_path / "ptx").iterdir():
        (found,) = read_clouds(file)
        expected = np.linspace(0, 1, 5000) if known else np.full(5000, 0.5)
        np.testing.assert_allclose(found.attributes["intensity"], expected)


def test_the_spacing_of_a_scan_that_comes_in_pieces() -> None:
    points = np.random.default_rng(0).normal(size=(20_000, 3)) + 1e6
    points[7000:9000] = points[:2000]  # several in one place
    probes = Probes(some_of(points))
    for piece in np.array_split(points, 17):
        probes.add(piece)
    assert probes.spacing == pytest.approx(spacing_of(points))
    nowhere = Probes(np.ones((3, 3)))
    nowhere.add(np.ones((5, 3)))
    assert nowhere.spacing == 0
