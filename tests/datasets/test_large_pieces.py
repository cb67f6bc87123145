"""Scans read piece by piece are those of the whole file."""

from __future__ import annotations

import gzip
import zipfile

import numpy as np
import pytest

import mvreg
from mvreg.datasets.large import StoredPoints
from mvreg.io import PointCloud, write_ply_clouds
from mvreg.io.e57_write import write_e57_scans
from mvreg.io.las_write import write_las_clouds
from tests.support.large_folders import RNG, folder, in_pieces_and_whole, pcd, text, write


def same(a, b):
    """Compare two scans and all that they are a part of; in how many pieces that of the first is.

    0 where nothing is left out of it.
    """
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.view_point, b.view_point)
    np.testing.assert_array_equal(a.initial, b.initial)
    assert (a.full is None) == (b.full is None)
    assert list(a.attributes) == list(b.attributes)
    if a.full is None:
        return 0
    assert (a.full.count, dict(a.full.kinds)) == (b.full.count, dict(b.full.kinds))
    points, attributes = b.full()
    assert {name: values.dtype for name, values in attributes.items()} == a.full.kinds
    parts = [*a.full.pieces()]
    np.testing.assert_array_equal(np.concatenate([p for p, _ in parts]), points)
    for key, values in attributes.items():
        found = np.concatenate([more[key] for _, more in parts])
        np.testing.assert_array_equal(found, values)
    return len(parts)


def write_ptx(path, points, grey):
    """Two scans, with `points` in each; NaN is no number of PTX."""
    header = f"{len(points)}\n1\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n"
    path.write_text(2 * (header + text(points, grey)))


@pytest.mark.parametrize("kind", ["las", "laz", "e57", "ptx", "pts", "laz.gz", "ply.gz", "zip"])
@pytest.mark.parametrize("zeros", [0, 1, 5])
def test_that_scans_in_pieces_are_those_of_the_whole_file(tmp_path, monkeypatch, kind, zeros):
    points, grey = RNG.normal(size=(5000, 3)).round(4), RNG.integers(0, 256, 5000).astype(np.uint8)
    points[10 : 10 + zeros] = 0
    cloud = PointCloud(points, attributes={"intensity": grey}, name="one", T_world_scan=np.eye(4))
    few = PointCloud(points[:250], attributes={"intensity": grey[:250]}, name="two")
    path = tmp_path / f"a.{kind}"
    plain = tmp_path / f"a.{kind.removesuffix('.gz')}"
    if plain.suffix in (".las", ".laz"):
        write_las_clouds(plain, [cloud], {"intensity": grey.dtype})
    elif kind == "e57":
        pytest.importorskip("pye57", reason="NOT TESTED: pye57 is not installed")
        write_e57_scans(path, [[cloud], [few], [cloud]])
    elif kind == "ptx":
        write_ptx(path, points, grey)
    elif kind == "pts":
        path.write_text(2 * (f"{len(points)}\n{text(points, grey)}"))
    elif kind == "ply.gz":
        write_ply_clouds(plain, [cloud], {"intensity": grey.dtype})
    else:
        write_ptx(tmp_path / "a.ptx", points, grey)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(tmp_path / "a.ptx", "a.ptx")
            archive.writestr("b.xyz", text(points, grey))
        (tmp_path / "a.ptx").unlink()
    if path != plain:
        path.write_bytes(gzip.compress(plain.read_bytes()))
        plain.unlink()
    if kind != "zip":  # archives beside other files are not looked into
        write(tmp_path / "z.ply", 100)
    asked = []
    real = StoredPoints.__call__
    monkeypatch.setattr(StoredPoints, "__call__", lambda one: asked.append(one) or real(one))
    pieces, whole = in_pieces_and_whole(tmp_path, monkeypatch)
    assert pieces.sources == whole.sources
    names = [scan.name for scan in pieces.scans]
    assert names == [scan.name for scan in whole.scans]
    assert len(names) == {"e57": 4, "ptx": 3, "pts": 3, "zip": 3}.get(kind, 2)
    for a, b in zip(pieces.scans, whole.scans, strict=True):
        parts = same(a, b)
        if a.full is None:
            continue
        # A single point at 0, 0, 0 counts, but where it means a cell without a return.
        assert (parts > 1) == (zeros != 1 or ".ptx" in a.name)
        assert len(asked) == 1 + (parts == 1)
        asked.clear()


@pytest.mark.parametrize("name", ["a.ply", "a.pcd", "text.pcd", "a.xyz"])
@pytest.mark.parametrize("zeros", [0, 1, 5])
def test_that_pieces_give_the_points_that_the_whole_file_gives(tmp_path, monkeypatch, name, zeros):
    points, grey = RNG.normal(size=(5000, 3)), RNG.integers(0, 256, 5000).astype(np.uint8)
    points[10 : 10 + zeros], points[3000:3010, 1] = 0, np.nan
    if name == "a.ply":
        cloud = PointCloud(points, attributes={"grey": grey})
        write_ply_clouds(tmp_path / name, [cloud], {"grey": grey.dtype})
    elif name == "a.pcd":
        table = np.rec.fromarrays([*points.T, grey], dtype="<f8,<f8,<f8,u1")
        (tmp_path / name).write_bytes(pcd(points, "binary").encode() + table.tobytes())
    else:
        head = pcd(points, "ascii") if name == "text.pcd" else ""
        (tmp_path / name).write_text(head + text(points, grey))
    write(tmp_path / "z.ply", 100)
    pieces, whole = in_pieces_and_whole(tmp_path, monkeypatch)
    for a, b in zip(pieces.scans, whole.scans, strict=True):
        parts = same(a, b)
        if a.full is not None:
            points, attributes = a.full()
            assert len(points) == a.full.count == 4990 - zeros * (zeros > 1)
            assert {name: values.dtype for name, values in attributes.items()} == a.full.kinds
            assert (parts > 1) == (zeros != 1)


def test_that_a_compressed_scan_is_unpacked_once(tmp_path, monkeypatch):
    write(tmp_path / "b.ply", 1000)
    packed = gzip.compress((tmp_path / "b.ply").read_bytes())
    (tmp_path / "a.ply.gz").write_bytes(packed)
    monkeypatch.setattr("mvreg.io.compressed_pieces.WORTH", 0)
    unpacked, unpack = [], mvreg.io.unpacked._unpack
    monkeypatch.setattr(
        "mvreg.io.unpacked._unpack", lambda *given: unpacked.append(given) or unpack(*given)
    )
    a, b = folder(tmp_path, 5000).scans
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.attributes["grey"], b.attributes["grey"])
    assert len(unpacked) == 1
