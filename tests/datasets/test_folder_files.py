"""What is beside the scans of a folder, and what their files say besides the points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg.datasets import folder as folder_module
from mvreg.datasets.folder import Folder, home
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io import FORMATS, Format, PointCloud, ReadOptions, write_ply
from mvreg.types import ScanSet


def cloud(count: int = 500, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(count, 3))


def scans(folder: Path, *names: str, count: int = 500) -> Path:
    for seed, name in enumerate(names):
        write_ply(folder / name, cloud(count, seed))
    return folder


def load(folder: Path, **options: object) -> ScanSet:
    return Folder(path=str(folder), **options)(np.random.default_rng(0))  # type: ignore[arg-type]


def test_files_that_cannot_be_read_are_named_by_their_kind(tmp_path: Path) -> None:
    scans(tmp_path, "a.ply", "b.ply")
    for name in ("c.rxp", "d.FLS", "e.rxp", "README.md", "truth.conf", "photo.jpg", ".hidden.foo"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "second_day").mkdir()
    (tmp_path / ".git").mkdir()
    found = load(tmp_path)
    assert found.remarks == (
        "3 files were left out, of a kind that cannot be read: .fls, .rxp; 1 folder: second_day "
        "(dataset.recursive=true looks into it)",
    )
    assert found.input is not None and found.input.files == 2
    assert list(found.input.left_out) == [
        "c.rxp", "d.FLS", "e.rxp", "photo.jpg", "README.md", "truth.conf", "second_day/",
    ]  # fmt: skip
    only = load(scans(tmp_path, "a.ply", "b.ply"), pattern="*.ply")
    assert only.remarks == ("1 folder left out: second_day (dataset.recursive=true looks into it)",)


def test_folders_within_are_read_if_asked_for_but_for_runs(tmp_path: Path) -> None:
    scans(tmp_path, "a.ply", "day 2/a.ply", "day 10/deep/b.ply", "runs/x/model.ply")
    (tmp_path / "runs/x/result.json").write_text("{}")
    found = load(tmp_path, recursive=True)
    assert [scan.name for scan in found.scans] == ["a.ply", "day 2/a.ply", "day 10/deep/b.ply"]
    with pytest.raises(InputError, match=r"found a\.ply among .*; dataset\.recursive=true looks"):
        load(tmp_path)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("camera.txt", "525 0 319.5\n0 525 239.5\n0 0 1\n"),
        ("a_pose.txt", "1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n"),
        ("trajectory.csv", "t,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n1,1,2,4,0,0,0,1\n"),
        ("targets.xyz", "1 2 3\n4 5 6\n7 8 9\n1 1 1\n"),
        ("notes.txt", "Scanned on a turntable, 6 steps.\n"),
        ("empty.csv", ""),
    ],
)
def test_what_is_no_scan_is_left_out_and_named(tmp_path: Path, name: str, text: str) -> None:
    scans(tmp_path, "b.ply", "c.ply")
    for copy in ("", "1", "2"):
        (tmp_path / f"{copy}{name}").write_text(text)
    found = load(tmp_path)
    assert [scan.name for scan in found.scans] == ["b.ply", "c.ply"]
    (remark,) = found.remarks
    assert remark.startswith(f"left out 3 files without a scan: {name}, 1{name} and 1 more (") or (
        remark.startswith(f"left out 3 files without a scan: 1{name}, 2{name} and 1 more (")
    )
    assert found.input is not None and found.input.files == 2
    assert set(found.input.left_out) == {name, f"1{name}", f"2{name}"}


def test_small_scans_among_small_ones_are_scans(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("1 2 3\n2 3 4\n5 5 6\n")
    scans(tmp_path, "b.ply", count=60)
    assert len(load(tmp_path).scans) == 2


def test_notes_alone_are_an_error(tmp_path: Path) -> None:
    scans(tmp_path, "a.ply")
    (tmp_path / "notes.txt").write_text("nothing\n")
    with pytest.raises(InputError, match=r"1 of 2 files cannot be read.*\n.*notes\.txt, line 1"):
        load(tmp_path)


def test_a_damaged_file_of_scans_is_an_error_still(tmp_path: Path) -> None:
    scans(tmp_path, "a.ply", "b.ply", "c.ply")
    (tmp_path / "c.ply").write_bytes((tmp_path / "c.ply").read_bytes()[:-5])
    with pytest.raises(InputError, match=r"1 of 3 files cannot be read.*\n.*c\.ply"):
        load(tmp_path)


POSE = se3.random(np.random.default_rng(3), 4.0)


def several(path: Path, options: ReadOptions) -> Sequence[PointCloud]:
    """Two scans; a file's text names them, or not."""
    names = path.read_text().split(",")
    first = PointCloud(
        np.vstack([cloud(), np.zeros((3, 3))]), view_point=np.array([1.0, 2, 3]), name=names[0],
        attributes={"intensity": np.arange(503)}, T_world_scan=POSE, levelled=True,
        remarks=(f"left out {len(path.stem)} rows",),
    )  # fmt: skip
    return first, replace(first, name=names[-1], view_point=None, T_world_scan=None, levelled=False)


@pytest.fixture
def with_several(monkeypatch: pytest.MonkeyPatch) -> None:
    known = {
        s: each for each in (*FORMATS, Format("several", (".two",), several)) for s in each.suffixes
    }
    monkeypatch.setattr(folder_module.manager, "formats", lambda: known)


@pytest.mark.parametrize(
    ("text", "names"), [("door,window", ["door", "window"]), ("", ["1", "2"]), ("a,a", ["1", "2"])]
)
@pytest.mark.usefixtures("with_several")
def test_a_file_may_hold_several_scans(tmp_path: Path, text: str, names: list[str]) -> None:
    (tmp_path / "x.two").write_text(text)
    found = load(tmp_path, most_points=100)
    assert [scan.name for scan in found.scans] == [f"x.two:{name}" for name in names]
    for scan in found.scans:
        assert len(scan.points) == 100 and scan.full is not None and scan.full.count == 500
        np.testing.assert_array_equal(scan.full()[0], cloud())
    assert found.input is not None and found.input.files == 1


@pytest.mark.usefixtures("with_several")
def test_all_that_a_file_says_is_kept(tmp_path: Path) -> None:
    (tmp_path / "x.two").write_text("a,b")
    (tmp_path / "long.two").write_text("a,b")
    found = load(tmp_path)
    first, second = found.scans[:2]
    assert found.sensors == {"long.two:a": "file", "x.two:a": "file"}
    np.testing.assert_array_equal(first.view_point, [1, 2, 3])
    np.testing.assert_array_equal(first.up, [0, 0, 1])
    assert second.up is None and second.view_point is None
    np.testing.assert_array_equal(first.attributes["intensity"], np.arange(500))
    np.testing.assert_allclose(found.initial["x.two:a"], POSE)
    assert set(found.initial) == {"long.two:a", "x.two:a"}
    assert found.remarks == (
        "dropped 12 points at exactly 0, 0, 0, where the sensor saw nothing, from 4 of 4 scans",
        "long.two:a: left out 4 rows (and 3 more scans alike)",
    )
    moved = load(tmp_path, scramble=True)
    for scan in moved.scans:
        if scan.name in moved.initial:
            world = se3.apply(moved.initial[scan.name], scan.points)
            np.testing.assert_allclose(world, se3.apply(POSE, cloud()), atol=1e-9)


def test_columns_of_a_folder_of_tables(tmp_path: Path) -> None:
    for seed in range(2):
        rows = np.column_stack([np.arange(500), np.arange(500) % 7, cloud(500, seed)])
        np.savetxt(tmp_path / f"{seed}.csv", rows, fmt="%.6f", delimiter=",")
    (remark,) = load(tmp_path).remarks
    assert remark.startswith("0.csv: took columns 1, 2 and 3 of 5 for x, y and z")
    assert remark.endswith("(and 1 more scan alike)")
    found = load(tmp_path, columns=["_", "ring", "x", "y", "z"])
    assert found.remarks == ()
    for seed, scan in enumerate(found.scans):
        np.testing.assert_allclose(scan.points, cloud(500, seed), atol=1e-6)
        assert list(scan.attributes) == ["ring"]
    with pytest.raises(InputError, match=r"dataset\.columns"):
        Folder(path="x", columns=["a", "b"])


@pytest.mark.parametrize("name", ["~nobody_has_this_name", "~", "a=b"])
def test_a_folder_named_like_a_home_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    scans(tmp_path / name, "a.ply", "b.ply")
    assert load(Path(name)).name == name
    assert home("~nobody_has_that_name_either") == Path("~nobody_has_that_name_either")


def test_scans_beside_poses_and_matrices_are_all_placed(tmp_path: Path) -> None:
    data = mvreg.dataset("tiny", scramble=True, rng=3, views=4)
    for scan in data.scans:
        write_ply(tmp_path / f"{scan.name}.ply", scan.points)
        np.savetxt(tmp_path / f"{scan.name}_pose.txt", data.poses[scan.name])  # type: ignore[index]
    (tmp_path / "camera.txt").write_text("525 0 319.5\n0 525 239.5\n0 0 1\n")
    result = mvreg.register(mvreg.dataset("folder", path=str(tmp_path)))
    assert sorted(result.poses) == [f"tiny_0{index}.ply" for index in range(4)]
