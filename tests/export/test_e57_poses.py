"""Poses written into the E57 files that came, and nothing else changed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mvreg
from mvreg.cli.main import main
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io import read_clouds
from mvreg.io.e57_pages import PAGE, crc32c
from mvreg.io.e57_poses import positions, rewrite_poses

pye57 = pytest.importorskip("pye57", reason="needs pye57")
RNG = np.random.default_rng(9)


def pose(shift=5e6):
    rotation = Rotation.from_rotvec(RNG.normal(size=3)).as_matrix()
    return se3.from_parts(rotation, shift * RNG.normal(size=3))


def write(path, poses, count=500):
    """A file of scans, by pye57; None for one without a pose."""
    file = pye57.E57(str(path), mode="w")
    for index, each in enumerate(poses):
        points = {f"cartesian{axis}": RNG.normal(size=count) for axis in "XYZ"} | {
            "intensity": RNG.uniform(size=count)
        }
        more = {}
        if each is not None:
            rotation = Rotation.from_matrix(each[:3, :3]).as_quat()[[3, 0, 1, 2]]
            more = {"rotation": rotation, "translation": each[:3, 3]}
        file.write_scan_raw(points, name=f"s{index}", **more)
    file.close()
    return path


def test_crc():
    assert crc32c(b"123456789") == 0xE3069283  # the check value of CRC-32C


@pytest.mark.parametrize("count", [1, 40])
def test_that_only_the_poses_change(tmp_path, count):
    path = write(tmp_path / "a.e57", [None, *(pose(1.0) for _ in range(count))])
    before, before_bytes = read_clouds(path), path.read_bytes()
    wanted = {index: pose() for index in range(0, count + 1, 2)}
    rewrite_poses(path, tmp_path / "b.e57", wanted)
    assert path.read_bytes() == before_bytes
    after = read_clouds(tmp_path / "b.e57")
    assert len(after) == count + 1
    for index, (old, new) in enumerate(zip(before, after, strict=True)):
        np.testing.assert_array_equal(new.points, old.points)
        assert (new.name, set(new.attributes)) == (old.name, set(old.attributes))
        for name, values in old.attributes.items():
            np.testing.assert_array_equal(new.attributes[name], values)
        if index in wanted:
            np.testing.assert_allclose(new.T_world_scan, wanted[index], rtol=1e-12, atol=1e-12)
        elif old.T_world_scan is not None:
            np.testing.assert_array_equal(new.T_world_scan, old.T_world_scan)
    # Points are to the bit: no page of them has changed.
    file = (tmp_path / "b.e57").read_bytes()
    assert len(file) % PAGE == 0
    start = int.from_bytes(before_bytes[24:32], "little") // PAGE * PAGE
    assert file[PAGE:start] == before_bytes[PAGE:start]
    for first in range(0, len(file), PAGE):
        page = file[first : first + PAGE]
        assert crc32c(page[:-4]) == int.from_bytes(page[-4:], "big")


def test_that_pye57_reads_them(tmp_path):
    path = write(tmp_path / "a.e57", [pose(1.0), pose(1.0)])
    wanted = pose()
    rewrite_poses(path, tmp_path / "b.e57", {1: wanted})
    file = pye57.E57(str(tmp_path / "b.e57"))
    header = file.get_header(1)
    np.testing.assert_allclose(header.rotation_matrix, wanted[:3, :3], atol=1e-12)
    np.testing.assert_allclose(header.translation, wanted[:3, 3], rtol=1e-14)


def test_that_what_is_no_e57_is_refused(tmp_path):
    (tmp_path / "a.e57").write_bytes(b"x" * 100)
    with pytest.raises(InputError, match="byte 0: expected an E57 file"):
        positions(tmp_path / "a.e57")
    path = write(tmp_path / "b.e57", [None])
    with pytest.raises(InputError, match="expected a scan 8, found 1"):
        rewrite_poses(path, tmp_path / "c.e57", {7: np.eye(4)})
    path.write_bytes(path.read_bytes()[:-PAGE])
    with pytest.raises(InputError, match="the header contradicts the file"):
        rewrite_poses(path, tmp_path / "c.e57", {0: np.eye(4)})


def test_that_a_run_of_e57_files_gives_them_back_with_its_poses(tmp_path, capsys):
    scans = mvreg.dataset("tiny", scramble=True, rng=3)
    folder = tmp_path / "in"
    folder.mkdir()
    file = pye57.E57(str(folder / "all.e57"), mode="w")
    for scan in scans.scans:
        points = {f"cartesian{axis}": scan.points[:, k] for k, axis in enumerate("XYZ")}
        file.write_scan_raw(points, name=scan.name)
    file.close()
    run = tmp_path / "run"
    arguments = ["dataset=folder", f"dataset.path={folder}", "rerun=false", "report=false"]
    assert main([*arguments, "export=[e57_poses]", f"hydra.run.dir={run}"]) == 0
    moved = [
        se3.apply(cloud.T_world_scan, cloud.points)
        for cloud in read_clouds(run / "export" / "e57_poses" / "all.e57")
    ]
    frame = np.linalg.lstsq(
        np.column_stack([moved[0], np.ones(len(moved[0]))]),
        se3.apply(scans.poses["tiny_00"], scans.scans[0].points), rcond=None,
    )[0]  # fmt: skip
    for scan, points in zip(scans.scans, moved, strict=True):
        expected = se3.apply(scans.poses[scan.name], scan.points)
        np.testing.assert_allclose(
            np.column_stack([points, np.ones(len(points))]) @ frame, expected, atol=1.0
        )
