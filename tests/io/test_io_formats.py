"""The formats besides PLY, and what all of them do with trouble."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mvreg._open3d import load_open3d
from mvreg.errors import InputError, MvregError
from mvreg.io import READERS, SUPPORTED, iterate_clouds, read_points, write_ply

POINTS = np.array([[0.5, 1.25, -2.0], [1.0, 0.0, 3.5], [-4.0, 8.0, 0.125], [1.0, 1.0, 1.0]])
ROWS = [" ".join(map(str, row)) for row in POINTS.tolist()]
SPHERE = "facet normal 0 0 1\nouter loop\nvertex {}\nvertex {}\nvertex {}\nendloop\nendfacet\n"
STL = ("solid x\n" + SPHERE.format(*ROWS[:3]) + SPHERE.format(*ROWS[1:]) + "endsolid x\n").encode()
PCD = (
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE {size} {size} {size}\nTYPE F F F\n"
    "COUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {data}\n"
)


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def pcd(data: str, body: bytes, n: int = 4, size: int = 4) -> bytes:
    return PCD.format(data=data, n=n, size=size).encode() + body


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.xyz", "\n".join(ROWS)),
        ("a.XYZ", "\r\n".join(ROWS) + "\r\n"),
        ("mac.xyz", "\r".join(ROWS) + "\r"),
        ("a.txt", "\ufeffX Y Z\n\n" + "\n".join(ROWS) + "\n\n"),
        ("comma.csv", "\n".join(row.replace(" ", ", ") for row in ROWS)),
        ("semicolon.csv", '"x";"y";"z"\n' + "\n".join(row.replace(" ", ";") for row in ROWS)),
        ("german.csv", "\n".join(r.replace(" ", ";").replace(".", ",") for r in ROWS)),
        ("german.txt", "\n".join(row.replace(".", ",") for row in ROWS)),
        ("tab.txt", "# a comment, with 1 2 3\n" + "\n".join(r.replace(" ", "\t") for r in ROWS)),
        ("a.pts", "4\n" + "\n".join(f"{row} -20 1 2 3" for row in ROWS)),
        ("cloudcompare.asc", "//X,Y,Z,R\n4\n" + "\n".join(f"{row} 9" for row in ROWS)),
        ("named.csv", "id,x,y,z\n" + "\n".join(f"7,{r.replace(' ', ',')}" for r in ROWS)),
        ("middle.txt", "\n".join([*ROWS[:2], "# pause", "nan 0 0", "", *ROWS[2:]])),
        ("a.obj", "# c\nv " + "\nv ".join(ROWS) + "\nvn 0 0 1\nvt 0 0\nf 1 2 3\n"),
        ("only_points.obj", "v " + "\r\nv ".join(ROWS)),
        ("colours.obj", "".join(f"  v\t{row} 1 0 0\n" for row in ROWS)),
        ("ascii.pcd", pcd("ascii", "\n".join(ROWS).encode())),
        ("binary.pcd", pcd("binary", POINTS.astype("<f4").tobytes())),
        ("double.pcd", pcd("binary", POINTS.tobytes(), size=8)),
    ],
)
def test_points_come_back(tmp_path: Path, name: str, content: str | bytes) -> None:
    points = read_points(write(tmp_path / name, content))
    assert points.dtype == np.float64
    np.testing.assert_array_equal(points, POINTS)


@pytest.mark.parametrize(
    "save",
    [
        lambda path: np.save(path, POINTS),
        lambda path: np.save(path, np.hstack([POINTS, POINTS]).astype(np.float32)),
        lambda path: np.save(path, np.asfortranarray(POINTS)),
    ],
)
def test_npy(tmp_path: Path, save: Callable[[Path], None]) -> None:
    save(tmp_path / "a.npy")
    points = read_points(tmp_path / "a.npy")
    np.testing.assert_array_equal(points, POINTS)
    assert points.flags.c_contiguous


def test_npz_takes_points_or_the_only_array(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", points=POINTS, colours=POINTS + 1)
    np.savez(tmp_path / "b.npz", POINTS)
    np.savez(tmp_path / "c.npz", a=POINTS, b=POINTS)
    np.testing.assert_array_equal(read_points(tmp_path / "a.npz"), POINTS)
    np.testing.assert_array_equal(read_points(tmp_path / "b.npz"), POINTS)
    with pytest.raises(InputError, match=r"named 'points', .*; found \['a', 'b'\]"):
        read_points(tmp_path / "c.npz")


@pytest.mark.parametrize("compressed", [False, True])
def test_open3d_pcd_reads_back(tmp_path: Path, compressed: bool) -> None:
    open3d = load_open3d()
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(POINTS.repeat(50, axis=0)))
    cloud.normals = cloud.points
    path = tmp_path / "a.pcd"
    assert open3d.io.write_point_cloud(str(path), cloud, compressed=compressed)
    np.testing.assert_array_equal(read_points(path), POINTS.repeat(50, axis=0))
    whole = path.read_bytes()
    write(path, whole[:-3])
    with pytest.raises(InputError, match="truncated"):
        read_points(path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.xyz", "x y z\n1 2 3\n4 five 6\n", "line 3: expected a number, got 'five'"),
        ("a.csv", "1,2,3\n4,6\n", "line 2: expected 3 numbers, got 2"),
        ("a.xyz", "1 2\n3 4\n", "line 1: expected lines of at least 3 numbers, got '1 2'"),
        (
            "a.txt",
            "just words\nand more\n",
            "line 1: expected lines of at least 3 numbers, got 'just words'",
        ),
        ("a.csv", "", "found none"),
        ("a.xyz", "nan nan nan\n", "only NaN"),
        ("a.obj", "f 1 2 3\n", "expected lines 'v X Y Z'"),
        ("a.obj", "v 1 2\n", "line 1: expected 'v X Y Z', got 2"),
        ("a.obj", "v 1 2 3\n\nv 1 x 3\n", "line 3: expected a number"),
        ("a.stl", STL[: STL.index(b"endfacet") + 9], "before 'endsolid'"),
        ("a.stl", bytes(80) + b"\x02\0\0\0" + bytes(50), "expected an STL file"),
        ("a.stl", b"", "expected an STL file"),
        ("a.pcd", b"", "line 1: expected a PCD header"),
        ("a.pcd", b"\x93\x00\n", "line 1: expected a PCD header"),
        # Open3D makes zeros, or worse, of the missing lines.
        ("a.pcd", pcd("ascii", b"1 2 3\n4 5 6\n"), "announces 4 points, but only 2 lines"),
        ("a.pcd", pcd("ascii", b"1 2 3\n4 x 6\n" * 2), "line 13: expected a number, got 'x'"),
        ("a.pcd", pcd("binary", b"\0" * 47), "only 47 bytes follow"),
        ("a.pcd", pcd("binary", b"", n=10**14), "announces 100000000000000 points"),
        ("a.pcd", pcd("binary_compressed", b"\0" * 4), "only 4 bytes follow"),
        ("a.pcd", pcd("binary_compressed", b"\x01\0\0\0\x30\0\0\0\0", n=400), "400|4800"),
        ("a.pcd", pcd("binary", b"", size=3), "SIZE 1 to 8"),
        ("a.pcd", pcd("binary", b"").replace(b" z", b" q"), "expected fields x, y and z"),
        ("a.pcd", pcd("binary", b"").replace(b"COUNT 1", b"COUNT"), "as many"),
        ("a.pcd", pcd("morse", b""), "expected DATA"),
        ("a.npy", b"", "not a readable NumPy file"),
        ("a.npy", b"\x93NUMPY\x01\x00", "not a readable NumPy file"),
        ("a.npz", b"PK\x03\x04", "not a readable NumPy file"),
        ("a.step", b"", "expected a file ending in .ply, "),
        ("noending", b"", "no suffix"),
    ],
)
def test_damage_is_named(tmp_path: Path, name: str, content: str | bytes, message: str) -> None:
    path = write(tmp_path / name, content)
    with pytest.raises(InputError, match=message) as caught:
        read_points(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 2)), np.zeros(3), np.zeros((0, 3)), np.zeros((2, 3, 3), np.uint8),
        np.array(5.0), np.zeros((3, 3)), np.zeros((480, 640)), np.eye(4),
        np.zeros((2, 3), complex), np.zeros((2, 3), bool), np.array([["a"] * 3]),
        np.zeros((2, 5, 5, 3)), np.zeros((2, 3, 2)), np.zeros(4, [("a", float), ("b", float)]),
    ],
)  # fmt: skip
def test_wrong_arrays_are_refused(tmp_path: Path, array: np.ndarray) -> None:
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(InputError, match="expected"):
        read_points(tmp_path / "a.npy")


def test_pickled_objects_are_not_run(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.array([print, None, 3], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="allow_pickle"):
        read_points(tmp_path / "a.npy")


@pytest.mark.parametrize("suffix", SUPPORTED)
def test_missing_files_and_folders_are_refused(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_points(tmp_path / f"missing{suffix}")
    folder = tmp_path / f"folder{suffix}"
    folder.mkdir()
    with pytest.raises(InputError, match="found a folder"):
        read_points(folder)


@pytest.mark.parametrize("suffix", SUPPORTED)
def test_a_forbidden_file_is_refused(
    tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / f"a{suffix}", "1 2 3\n")
    path.chmod(0)
    if os.access(path, os.R_OK):  # root may read everything

        def forbid(self: Path, *args: object, **kwargs: object) -> None:
            raise PermissionError(13, "Permission denied", str(self))

        monkeypatch.setattr(Path, "read_bytes", forbid)
        monkeypatch.setattr(Path, "open", forbid)
    with pytest.raises(InputError, match="Permission denied"):
        read_points(path)


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A good file per format, to be damaged."""
    folder = tmp_path_factory.mktemp("samples")
    write_ply(folder / "a.ply", POINTS, POINTS)
    np.save(folder / "a.npy", POINTS)
    np.savez_compressed(folder / "a.npz", points=POINTS)
    good = {f".{name}": (folder / f"a.{name}").read_bytes() for name in ("ply", "npy", "npz")}
    good |= {s: "\n".join(ROWS).encode() for s in (".xyz", ".txt", ".csv", ".pts", ".asc")}
    good[".obj"] = ("v " + "\nv ".join(ROWS)).encode()
    good[".pcd"] = pcd("binary", POINTS.astype("<f4").tobytes())
    good[".stl"] = STL
    assert set(good) <= set(READERS)  # those of several scans, and binary ones: test_fuzz_readers
    return good


@settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.data())
def test_any_damage_is_an_error_or_points(
    tmp_path: Path, samples: dict[str, bytes], data: st.DataObject
) -> None:
    suffix = data.draw(st.sampled_from(sorted(samples)))
    content = bytearray(samples[suffix])
    match data.draw(st.sampled_from(["cut", "change", "garbage"])):
        case "cut":
            del content[data.draw(st.integers(0, len(content))) :]
        case "change":
            for _ in range(data.draw(st.integers(1, 5))):
                at = data.draw(st.integers(0, len(content) - 1))
                content[at] = data.draw(st.integers(0, 255))
        case "garbage":
            content[:] = data.draw(st.binary(max_size=300))
    path = write(tmp_path / f"a{suffix}", bytes(content))
    try:
        points = read_points(path)
    except InputError as error:
        assert str(path) in str(error)
        return
    assert points.shape[1:] == (3,)
    assert len(points) > 0
    assert np.isfinite(points).all()


def test_open3d_is_imported_in_one_place() -> None:
    root = Path(__file__).parents[2] / "mvreg"
    pattern = re.compile(r"^\s*(import|from) open3d", re.MULTILINE)
    found = [p.name for p in root.rglob("*.py") if pattern.search(p.read_text("utf-8"))]
    assert found == ["_open3d.py"]


def test_reading_does_not_load_heavy_modules() -> None:
    code = (
        "import sys, mvreg.io, mvreg.datasets.stanford, mvreg.datasets.folder\n"
        "print(sorted({'open3d', 'rerun', 'rich', 'pooch', 'scipy', 'platformdirs', "
        "'laspy', 'pye57', 'trimesh'} & "
        "set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_without_open3d_the_error_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(MvregError, match="pip install mvreg"):
        load_open3d()


def test_that_warnings_are_off_inside_the_readers_alone(tmp_path: Path) -> None:
    path = write(tmp_path / "a.pts", b"1\n1 2 3\n1\n4 5 6\n")
    before = np.geterr()
    seen = [np.geterr() for _ in iterate_clouds(path)]
    assert seen == [before, before]
