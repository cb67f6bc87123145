"""Points read back by another program are where they were, at five million, too."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from exported import OFFSET, SPACING, expected, model

import mvreg
import mvreg.io
from mvreg.export.table import BY_NAME
from mvreg.io.cloud_stream import spacing_of
from mvreg.io.las_write import scale_for
from mvreg.types import Scan

CLOSE = SPACING / 100


@dataclass(frozen=True)
class Whole:
    """All of a scan of which a part is held."""

    scan: Scan

    @property
    def count(self):
        return len(self.scan.points)

    @property
    def kinds(self):
        return {name: values.dtype for name, values in self.scan.attributes.items()}

    def __call__(self):
        return self.scan.points, self.scan.attributes

    def pieces(self):
        yield self()


@pytest.fixture(params=[0.0, OFFSET], ids=["near", "far"])
def found(request, rng):
    return model(rng, request.param)


def indices(found):
    return np.repeat(np.arange(3), [len(s.points) for s in found.scanset.scans[:3]])


@pytest.mark.parametrize("name", ["las", "laz"])
def test_laspy_reads_the_model(name, found, tmp_path):
    import laspy

    said = BY_NAME[name].write(tmp_path, found)
    read = laspy.read(tmp_path / f"model.{name}")
    np.testing.assert_allclose(read.xyz, expected(found), rtol=0, atol=CLOSE)
    assert (read["scan_index"] == indices(found)).all()
    first = found.scanset.scans[0]
    count = len(first.points)
    assert (read.red[:count] == first.attributes["red"].astype(int) * 257).all()
    assert (read.intensity[:count] == first.attributes["intensity"]).all()
    assert (read["residual"][:count] == first.attributes["residual"]).all()
    assert any(each.startswith("red: 0 for the points of 1 scan") for each in said)


def test_a_scale_is_a_thousandth_of_the_spacing_unless_32_bits_are_too_few():
    assert scale_for(0.02, 100) == 1e-5
    assert scale_for(1.0, 1000) == 1e-3
    assert scale_for(1e-4, 1e5) * 2**31 > 1e5


@pytest.mark.parametrize("name", ["las", "scans"])
def test_a_scale_is_that_of_the_points_written_not_of_those_held(name, found, tmp_path):
    """Of a large scan the corners are held; what is written is many times as dense."""
    import laspy

    scans = []
    for scan in found.scanset.scans:
        own = scan.name.replace("ply", "las").replace("pcd", "las")
        scans.append(replace(scan.chosen(np.array([0, 19, 380, 399])), name=own, full=Whole(scan)))
    poses = {scans[i].name: pose for i, pose in enumerate(found.component.poses.values())}
    component = replace(found.component, poses=poses, reference=scans[0].name)
    thinned = replace(
        found, component=component, scanset=replace(found.scanset, scans=tuple(scans)),
        placements=replace(found.placements, names=tuple(s.name for s in scans)),
    )  # fmt: skip
    assert scans[0].spacing > 10 * found.scanset.scans[0].spacing
    said = BY_NAME[name].write(tmp_path, thinned)
    assert not any("in units of" in each for each in said)
    for path in tmp_path.rglob("*.las"):
        with laspy.open(path) as file:
            assert list(file.header.scales) == [1e-5] * 3
    if name == "las":
        read = laspy.read(tmp_path / "model.las").xyz
        np.testing.assert_allclose(read, expected(found), rtol=0, atol=1e-5)


def test_points_in_one_place_do_not_count_as_spacing():
    points = np.repeat(np.arange(30.0).reshape(10, 3), 3, axis=0)
    assert spacing_of(points) == pytest.approx(np.sqrt(27))
    assert spacing_of(np.repeat(points, 9, axis=0)) == pytest.approx(np.sqrt(27))
    assert spacing_of(points[:3]) == spacing_of(points[:1]) == 0


def test_open3d_reads_the_pcd(found, tmp_path):
    open3d = mvreg.load_open3d()
    BY_NAME["pcd"].write(tmp_path, found)
    # Its tensor reader: the other one takes coordinates of eight bytes for zeros, see findings.
    read = open3d.t.io.read_point_cloud(str(tmp_path / "model.pcd"))
    points = read.point.positions.numpy()
    np.testing.assert_allclose(points, expected(found), rtol=0, atol=CLOSE)
    first = found.scanset.scans[0]
    count = len(first.points)
    wanted = np.column_stack([first.attributes[name] for name in ("red", "green", "blue")])
    assert (read.point.colors.numpy()[:count] == wanted).all()
    turned = np.column_stack([first.attributes[name] for name in ("nx", "ny", "nz")])
    turned = turned @ found.component.poses["a.ply"][:3, :3].T
    # Open3D takes normals of four bytes beside coordinates of eight for something else.
    again = mvreg.io.read_cloud(tmp_path / "model.pcd").attributes
    normals = np.column_stack([again[name][:count] for name in ("nx", "ny", "nz")])
    np.testing.assert_allclose(normals, turned, atol=1e-6)
    assert (read.point.scan_index.numpy().ravel() == indices(found)).all()


def test_pye57_reads_the_e57(found, tmp_path):
    pye57 = pytest.importorskip("pye57", reason="needs pye57")
    BY_NAME["e57"].write(tmp_path, found)
    file = pye57.E57(str(tmp_path / "model.e57"))
    read = [
        file.read_scan(number, intensity=True, ignore_missing_fields=True)
        for number in range(file.scan_count)
    ]
    points = np.concatenate([
        np.column_stack([scan[f"cartesian{axis}"] for axis in "XYZ"]) for scan in read
    ])  # fmt: skip
    np.testing.assert_allclose(points, expected(found), rtol=0, atol=CLOSE)
    assert (read[0]["intensity"] == found.scanset.scans[0].attributes["intensity"]).all()
    names = [file.get_header(number)["name"].value() for number in range(3)]
    assert names == list(found.component.poses)
    file.close()


def test_a_ptx_says_in_its_header_where_its_points_are(found, tmp_path):
    """A literal reading: columns, rows, position, axes, and a matrix for row vectors."""
    BY_NAME["ptx"].write(tmp_path, found)
    points = []
    for name in ("a", "b_scan", "c"):
        lines = (tmp_path / "ptx" / f"{name}.ptx").read_text().splitlines()
        columns, rows = map(int, lines[:2])
        head = [np.array(line.split(), dtype=float) for line in lines[2:10]]
        matrix = np.stack(head[4:])
        body = np.array([line.split()[:4] for line in lines[10:]], dtype=float)
        assert len(body) == columns * rows
        points.append((np.c_[body[:, :3], np.ones(len(body))] @ matrix)[:, :3])
        assert (head[0] == matrix[3, :3]).all()
        assert (np.stack(head[1:4]) == matrix[:3, :3]).all()
        assert 0 <= body[:, 3].min() <= body[:, 3].max() <= 1
    np.testing.assert_allclose(np.concatenate(points), expected(found), rtol=0, atol=CLOSE)


def test_scans_moved_are_files_of_their_own(found, tmp_path):
    BY_NAME["scans"].write(tmp_path, found)
    files = ["a.ply", "b_scan.ply", "c.pcd"]
    assert sorted(file.name for file in (tmp_path / "scans").iterdir()) == files
    read = [mvreg.io.read_points(tmp_path / "scans" / file) for file in files]
    np.testing.assert_allclose(np.concatenate(read), expected(found), rtol=0, atol=CLOSE)


def test_the_merged_ply(found, tmp_path):
    from mvreg.io import read_cloud

    BY_NAME["ply"].write(tmp_path, found)
    read = read_cloud(tmp_path / "model.ply")
    np.testing.assert_allclose(read.points, expected(found), rtol=0, atol=CLOSE)
    assert (read.attributes["scan_index"] == indices(found)).all()
