"""Of large scans some points are registered, and the model has all."""

from __future__ import annotations

import gzip
import os
import tracemalloc
import zipfile

import numpy as np
import pytest

import mvreg
from mvreg.datasets.folder import Folder
from mvreg.datasets.large import StoredPoints
from mvreg.datasets.sample import Sample, drawn
from mvreg.errors import InputError
from mvreg.io import NotInPiecesError, PointCloud, read_cloud, write_ply_clouds
from mvreg.io.e57_write import write_e57_scans
from mvreg.io.las_write import write_las_clouds
from mvreg.report.model import INDEX
from mvreg.report.run_folder import write_model

RNG = np.random.default_rng(3)


def write(path, count):
    points = RNG.normal(size=(count, 3))
    grey = RNG.integers(0, 256, count).astype(np.uint8)
    write_ply_clouds(path, [PointCloud(points, attributes={"grey": grey})], {"grey": grey.dtype})
    return points, grey


def folder(path, most, **more):
    return Folder(path=str(path), most_points=most, **more)(np.random.default_rng(0))


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


def refuse(*_):
    raise NotInPiecesError


def in_pieces_and_whole(path, monkeypatch):
    """A folder of which files are read in pieces, and the same with all of them read whole."""
    monkeypatch.setattr("mvreg.io.pieces.BYTES", 10_000)
    for name in ("pieces.ROWS", "las.CHUNK", "e57.CHUNK"):
        monkeypatch.setattr(f"mvreg.io.{name}", 700)
    monkeypatch.setattr("mvreg.io.compressed_pieces.WORTH", 0)
    pieces = folder(path, 300)
    monkeypatch.setattr("mvreg.datasets.folder_scans.open_pieces", refuse)
    whole = folder(path, 300)
    assert pieces.remarks == whole.remarks
    return pieces, whole


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


def text(points, grey):
    return "".join(f"{x} {y} {z} {g}\n" for (x, y, z), g in zip(points.tolist(), grey, strict=True))


def pcd(points, kind):
    return (
        f"VERSION 0.7\nFIELDS x y z grey\nSIZE 8 8 8 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH "
        f"{len(points)}\nHEIGHT 1\nVIEWPOINT 1 2 3 1 0 0 0\nPOINTS {len(points)}\nDATA {kind}\n"
    )


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


def peak(path, name, count):
    """Bytes that it takes to read a folder with a scan of so many points, and write its model."""
    write(path / "b.ply", 2000)
    tracemalloc.start()
    scans = folder(path, 20_000)
    write_model(path / "out/model.ply", scans, {name: np.eye(4)})
    found = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert scans.scans[0].full.count == count
    return found


def test_that_a_part_of_a_compressed_scan_takes_a_part_of_its_memory(tmp_path, monkeypatch):
    """LAZ is not counted by tracemalloc where lazrs works, but all that we make of it is."""
    monkeypatch.setattr("mvreg.io.las.CHUNK", 10_000)
    peaks = []
    for count in (200_000, 400_000):
        points = RNG.normal(size=(count, 3))
        write_las_clouds(tmp_path / "a.laz", [PointCloud(points)], {})
        peaks.append(peak(tmp_path, "a.laz", count))
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < 24 * 400_000


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


def test_that_a_part_of_a_file_takes_a_part_of_its_memory(tmp_path, monkeypatch):
    """However large the file is: twice the points take no more."""
    monkeypatch.setattr("mvreg.io.pieces.ROWS", 10_000)
    peaks = []
    for count in (400_000, 800_000):
        write(tmp_path / "a.ply", count)
        peaks.append(peak(tmp_path, "a.ply", count))
    assert peaks[1] < 1.1 * peaks[0]
    assert peaks[1] < (tmp_path / "a.ply").stat().st_size / 4


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


def test_that_a_sample_does_not_depend_on_the_pieces():
    points = RNG.normal(size=(10_000, 3))
    whole = Sample(500)
    whole.add(points)
    parts = Sample(500)
    for piece in np.array_split(points, [0, 3, 700, 4000, 9999]):
        parts.add(piece)
    np.testing.assert_array_equal(parts.points(), whole.points())
    np.testing.assert_array_equal(parts.points(), points[drawn(10_000, 500)])
    assert parts.count == 10_000
    few = Sample(500)
    few.add(points[:400])
    np.testing.assert_array_equal(few.points(), points[:400])
    halves = np.bincount(drawn(10_000, 500) // 1000, minlength=10)
    assert halves.min() > 25  # from all over the file


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
