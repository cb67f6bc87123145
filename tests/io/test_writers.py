"""Files as other programs write them, each made here by the program itself."""

from __future__ import annotations

import gzip
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mvreg._open3d import load_open3d
from mvreg.errors import InputError
from mvreg.io import PointCloud, read_cloud, read_clouds

N = 500
SHIFT = np.array([600_000.0, 5_000_000.0, 100.0])
POINTS = np.random.default_rng(5).normal(size=(N, 3)).round(3) + SHIFT
NEAR = POINTS - SHIFT
COUNT = np.arange(N)


def need(module: str) -> Any:
    return pytest.importorskip(module, reason=f"NOT TESTED: {module} is not installed")


@pytest.mark.parametrize("suffix", ["las", "laz"])
@pytest.mark.parametrize("kind", [0, 1, 2, 3, 6, 7, 8])
def test_laspy(tmp_path: Path, kind: int, suffix: str) -> None:
    laspy = need("laspy")
    header = laspy.LasHeader(point_format=kind, version="1.4" if kind >= 6 else "1.2")
    header.scales, header.offsets = np.full(3, 1e-3), np.array([600_000.0, 5_000_000.0, 0.0])
    header.add_extra_dim(laspy.ExtraBytesParams("amplitude", "f4"))
    header.add_extra_dim(laspy.ExtraBytesParams("normal", "3i2"))
    data = laspy.LasData(header)
    data.x, data.y, data.z = POINTS.T
    data.intensity, data.classification = COUNT * 131, COUNT % 7
    data.amplitude, data.normal = COUNT / 8, np.stack([COUNT, -COUNT, COUNT + 1], axis=1)
    if "red" in header.point_format.dimension_names:
        data.red, data.blue = COUNT * 131, COUNT
    data.write(tmp_path / f"a.{suffix}")
    cloud = read_cloud(tmp_path / f"a.{suffix}")
    np.testing.assert_allclose(cloud.points, POINTS, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(cloud.attributes["intensity"], COUNT * 131)
    np.testing.assert_array_equal(cloud.attributes["classification"], COUNT % 7)
    np.testing.assert_array_equal(cloud.attributes["amplitude"], (COUNT / 8).astype("f4"))
    np.testing.assert_array_equal(cloud.attributes["normal_1"], -COUNT)
    if kind in (2, 3, 7, 8):
        np.testing.assert_array_equal(cloud.attributes["red"], COUNT * 131)
        assert cloud.attributes["green"].dtype == np.uint16  # zero, but a part of the colours
    assert cloud.view_point is None


@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_withheld_points_are_left_out_and_cut_files_refused(tmp_path: Path, suffix: str) -> None:
    laspy = need("laspy")
    data = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    data.x, data.y, data.z = NEAR.T
    data.withheld = (COUNT % 5 == 0).astype(np.uint8)
    path = tmp_path / f"a.{suffix}"
    data.write(path)
    cloud = read_cloud(path)
    assert len(cloud.points) == 400
    assert cloud.remarks == ("100 withheld points left out",)
    whole = path.read_bytes()
    for part in (0.1, 0.5, 0.9, 0.99):
        path.write_bytes(whole[: int(part * len(whole))])
        with pytest.raises(InputError, match=r"truncated|readable"):
            read_cloud(path)


def pose(turn: list[float], shift: list[float]) -> dict[str, Any]:
    return {"rotation": np.array(turn), "translation": np.array(shift)}


def columns(points: np.ndarray = NEAR) -> dict[str, np.ndarray]:
    return {f"cartesian{axis}": points[:, i].copy() for i, axis in enumerate("XYZ")}


def test_pye57_scans_with_poses_colours_and_invalid_points(tmp_path: Path) -> None:
    pye57 = need("pye57")
    path = tmp_path / "a.e57"
    more = {f"color{name}": (COUNT % 256).astype("u1") for name in ("Red", "Green", "Blue")}
    more["intensity"] = (COUNT / 512).astype("f4")
    more["cartesianInvalidState"] = (COUNT % 4 == 0).astype("i1")
    with pye57.E57(str(path), "w") as file:
        file.write_scan_raw({**columns(), **more}, name="a", **pose([0.5] * 4, [1.0, 2.0, 3.0]))
        file.write_scan_raw(columns(), name="b")
    first, second = read_clouds(path)
    valid = COUNT % 4 != 0
    np.testing.assert_allclose(first.points, NEAR[valid], atol=1e-6)
    assert (first.name, second.name) == ("a", "b")
    assert first.remarks == ("125 of 500 points without a return left out",)
    np.testing.assert_array_equal(first.attributes["red"], (COUNT % 256)[valid])
    assert first.attributes["red"].dtype == np.uint8
    np.testing.assert_array_equal(
        first.T_world_scan, [[0, 0, 1, 1], [1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 0, 1]]
    )
    np.testing.assert_array_equal(first.view_point, np.zeros(3))
    assert second.view_point is None  # the identity is written regardless


def write_low_level(
    path: Path, fields: dict[str, tuple[Any, np.ndarray]], libe57: Any, pye57: Any
) -> None:
    with pye57.E57(str(path), "w") as file:
        image = file.image_file
        scan = libe57.StructureNode(image)
        prototype = libe57.StructureNode(image)
        for name, (node, _) in fields.items():
            prototype.set(name, node(image))
        points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
        scan.set("guid", libe57.StringNode(image, "{a}"))
        scan.set("points", points)
        file.data3d.append(scan)
        buffers = libe57.VectorSourceDestBuffer()
        for name, (_, values) in fields.items():
            buffers.append(libe57.SourceDestBuffer(image, name, values, len(values), True, True))
        writer = points.writer(buffers)
        writer.write(len(next(iter(fields.values()))[1]))
        writer.close()


def test_e57_in_double_precision_16_bits_and_many_rows(tmp_path: Path) -> None:
    pye57 = need("pye57")
    libe57 = pye57.libe57

    def double(image: Any) -> Any:
        return libe57.FloatNode(image, 0.0, libe57.E57_DOUBLE, -1e9, 1e9)

    def integer(top: int) -> Any:
        return lambda image: libe57.IntegerNode(image, 0, 0, top)

    values = {"rowIndex": COUNT * 1000, "columnIndex": COUNT, "colorRed": COUNT * 131}
    fields = {
        **{name: (double, POINTS[:, i].copy()) for i, name in enumerate(columns())},
        "rowIndex": (integer(1_000_000), values["rowIndex"].astype("f8")),
        "columnIndex": (integer(1_000_000), values["columnIndex"].astype("f8")),
        **{f"color{c}": (integer(65535), values["colorRed"].astype("f8"))
           for c in ("Red", "Green", "Blue")},
    }  # fmt: skip
    path = tmp_path / "a.e57"
    write_low_level(path, fields, libe57, pye57)
    cloud = read_cloud(path)
    np.testing.assert_array_equal(cloud.points, POINTS)
    np.testing.assert_array_equal(cloud.attributes["rowIndex"], COUNT * 1000)
    np.testing.assert_array_equal(cloud.attributes["green"], COUNT * 131)
    assert cloud.attributes["green"].dtype == np.uint16
    assert cloud.T_world_scan is None
    np.testing.assert_array_equal(cloud.view_point, np.zeros(3))  # by row and column


def test_e57_of_scaled_integers(tmp_path: Path) -> None:
    """Thousandths about an offset, as several scanners' programs write coordinates."""
    pye57 = need("pye57")
    libe57 = pye57.libe57

    def scaled(offset: float) -> Any:
        return lambda image: libe57.ScaledIntegerNode(image, 0, -50_000, 50_000, 1e-3, offset)

    fields = {
        name: (scaled(shift), POINTS[:, i].copy())
        for i, (name, shift) in enumerate(zip(columns(), SHIFT, strict=True))
    }
    intensity = libe57.ScaledIntegerNode
    fields["intensity"] = (
        lambda image: intensity(image, 0, 0, 4095, 1 / 4095, 0.0), COUNT / 4095.0
    )  # fmt: skip
    path = tmp_path / "a.e57"
    write_low_level(path, fields, libe57, pye57)
    cloud = read_cloud(path)
    np.testing.assert_allclose(cloud.points, POINTS, rtol=0, atol=2e-9)
    np.testing.assert_allclose(cloud.attributes["intensity"], COUNT / 4095.0, atol=1e-7)


def test_e57_in_spherical_coordinates(tmp_path: Path) -> None:
    pye57 = need("pye57")
    libe57 = pye57.libe57
    distance = np.linalg.norm(NEAR, axis=1)
    spherical = [distance, np.arctan2(NEAR[:, 1], NEAR[:, 0]), np.arcsin(NEAR[:, 2] / distance)]
    names = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")

    def double(image: Any) -> Any:
        return libe57.FloatNode(image, 0.0, libe57.E57_DOUBLE, -1e9, 1e9)

    path = tmp_path / "a.e57"
    fields = {name: (double, v) for name, v in zip(names, spherical, strict=True)}
    write_low_level(path, fields, libe57, pye57)
    cloud = read_cloud(path)
    np.testing.assert_allclose(cloud.points, NEAR, atol=1e-12)
    np.testing.assert_array_equal(cloud.view_point, np.zeros(3))


def test_e57_cut_off_or_changed(tmp_path: Path) -> None:
    pye57 = need("pye57")
    path = tmp_path / "a.e57"
    with pye57.E57(str(path), "w") as file:
        file.write_scan_raw(columns())
    whole = path.read_bytes()
    path.write_bytes(whole[:-100])
    with pytest.raises(InputError, match="truncated"):
        read_cloud(path)
    changed = bytearray(whole)
    changed[1500] ^= 1
    path.write_bytes(changed)
    with pytest.raises(InputError, match=r"(?i)checksum"):
        read_cloud(path)


def test_without_pye57_the_error_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    head = b"ASTM-E57" + b"\1\0\0\0\0\0\0\0" + np.array([48, 0, 0, 1024], "<u8").tobytes()
    (tmp_path / "a.e57").write_bytes(head)
    monkeypatch.setitem(__import__("sys").modules, "pye57", None)
    with pytest.raises(InputError, match=r"pip install 'mvreg\[e57\]'"):
        read_cloud(tmp_path / "a.e57")


@pytest.mark.parametrize("kind", ["text", "<", ">"])
def test_plyfile(tmp_path: Path, kind: str) -> None:
    plyfile = need("plyfile")
    record = np.zeros(N, [(axis, "f8") for axis in "xyz"])
    for i, axis in enumerate("xyz"):
        record[axis] = POINTS[:, i]
    element = plyfile.PlyElement.describe(record, "vertex")
    order = "=" if kind == "text" else kind
    plyfile.PlyData([element], text=kind == "text", byte_order=order).write(tmp_path / "a.ply")
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.ply").points, POINTS)


@pytest.mark.parametrize("suffix", ["ply", "pcd", "xyz", "pts"])
@pytest.mark.parametrize("ascii", [True, False])
def test_open3d(tmp_path: Path, suffix: str, ascii: bool) -> None:
    open3d = load_open3d()
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(NEAR))
    path = str(tmp_path / f"a.{suffix}")
    assert open3d.io.write_point_cloud(path, cloud, write_ascii=ascii)
    np.testing.assert_allclose(read_cloud(path).points, NEAR, atol=1e-6)


SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.5]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def encoded(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


@pytest.mark.parametrize("suffix", ["stl", "obj", "off", "glb", "gltf"])
def test_trimesh(tmp_path: Path, suffix: str) -> None:
    trimesh = need("trimesh")
    path = tmp_path / f"a.{suffix}"
    mesh = trimesh.Trimesh(SQUARE, HALVES, process=False)
    if suffix == "gltf":
        files = trimesh.exchange.gltf.export_gltf(mesh.scene(), embed_buffers=True)
        path.write_bytes(files["model.gltf"])
    else:
        path.write_bytes(encoded(mesh.export(file_type=suffix)))
    cloud = read_cloud(path)
    assert "4 vertices, sampled at 20,000 points on 2 triangles" in cloud.remarks[0]
    np.testing.assert_allclose(cloud.points.max(axis=0), [2, 1, 0.5], atol=0.05)


@pytest.mark.parametrize("binary", [True, False])
def test_meshio_vtk(tmp_path: Path, binary: bool) -> None:
    meshio = need("meshio")
    mesh = meshio.Mesh(POINTS, [("vertex", COUNT[:, None])])
    mesh.write(tmp_path / "a.vtk", file_format="vtk42", binary=binary)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.vtk").points, POINTS)


def table(rows: np.ndarray) -> str:
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist())


HEAD = "{}\n{}\n{}\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n{} 1\n"


def scan(position: str = "5 6 7", shift: str = "5 6 7", rows: int = 5) -> str:
    return HEAD.format(N // 5, rows, position, shift) + table(np.c_[NEAR, COUNT / 512])


@pytest.mark.parametrize(
    ("position", "expected"), [("5 6 7", (0, 0, 0)), ("0 0 0", (0, 0, 0)), ("6 6 7", (0, -1, 0))]
)
def test_ptx_positions(tmp_path: Path, position: str, expected: tuple[float, ...]) -> None:
    (tmp_path / "a.ptx").write_text(scan(position) * 2)
    first, second = read_clouds(tmp_path / "a.ptx")
    assert (first.name, second.name) == ("scan1", "scan2")
    np.testing.assert_array_equal(second.points, NEAR)
    turned = [[0, -1, 0, 5], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]
    np.testing.assert_allclose(first.T_world_scan, turned, atol=1e-12)
    np.testing.assert_allclose(first.view_point, expected, atol=1e-12)
    assert not first.levelled


def test_ptx_oddities(tmp_path: Path) -> None:
    path = tmp_path / "a.ptx"
    path.write_text(scan().replace("0 0 1 0\n", "0 0 2 0\n"))
    assert read_cloud(path).T_world_scan is None
    assert "no rigid motion" in read_cloud(path).remarks[0]
    path.write_text(scan().replace("0 1 0 0\n-1 0 0 0", "0.8 0.61 0 0\n-0.6 0.8 0 0"))
    cloud = read_cloud(path)
    np.testing.assert_allclose(cloud.T_world_scan[:2, :2], [[0.8, -0.6], [0.6, 0.8]], atol=0.01)
    assert "no exact rotation, as of few decimals" in cloud.remarks[0]
    lines = scan().split("\n")
    lines[10] = lines[12] = "0 0 0 0.5"
    path.write_bytes("\r\n".join(lines).encode())
    cloud = read_cloud(path)
    assert len(cloud.points) == N - 2
    assert cloud.remarks == ("2 of 500 cells without a return left out",)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (scan(rows=6), "the file ends after 500 of 600 points|only"),
        (scan(rows=4), "the number of columns"),
        (scan(rows=10**8), "points are announced, but only"),
        (scan() + scan()[:2000], "line"),
        ("", "a PTX header"),
    ],
)
def test_ptx_counts_that_lie(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "a.ptx").write_text(content)
    with pytest.raises(InputError, match=message):
        read_clouds(tmp_path / "a.ptx")


@pytest.mark.parametrize(
    ("more", "names"),
    [(0, set()), (1, {"intensity"}), (3, {"red", "green", "blue"}),
     (4, {"intensity", "red", "green", "blue"})],
)  # fmt: skip
def test_pts_stations(tmp_path: Path, more: int, names: set[str]) -> None:
    rows = table(np.c_[POINTS, np.tile(COUNT[:, None] % 256, more)])
    (tmp_path / "a.pts").write_text(f"{N}\n{rows}{N}\n{rows}0\n")
    first, second = read_clouds(tmp_path / "a.pts")
    np.testing.assert_array_equal(second.points, POINTS)
    assert set(first.attributes) == names
    assert first.remarks == ("1 scan(s) without points left out: station3",)
    (tmp_path / "a.pts").write_text(f"{N + 1}\n{rows}")
    with pytest.raises(InputError, match="after 500 of 501 points"):
        read_clouds(tmp_path / "a.pts")
    (tmp_path / "a.pts").write_text(rows)
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.pts").points, POINTS)


def test_archives(tmp_path: Path) -> None:
    (tmp_path / "a.ptx.gz").write_bytes(gzip.compress(scan().encode()))
    np.testing.assert_array_equal(read_cloud(tmp_path / "a.ptx.gz").points, NEAR)
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x/", "")
        archive.writestr("x/a.ptx", scan() * 2)
        archive.writestr("../../b.xyz", table(NEAR))
        archive.writestr("notes.pdf", "%")
        archive.writestr("__MACOSX/._a.ptx", "?")
    clouds = read_clouds(tmp_path / "a.zip")
    assert [each.name for each in clouds] == ["x/a.ptx/scan1", "x/a.ptx/scan2", "b.xyz"]
    assert clouds[0].remarks == (
        "1 file(s) of the archive that are no scans left out: notes.pdf",
    )  # fmt: skip
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.ptx.gz", "a.zip"]


def test_archives_that_are_none_or_far_too_large(tmp_path: Path) -> None:
    zeros = b"0 0 0\n" * 2_000_000
    (tmp_path / "a.xyz.gz").write_bytes(gzip.compress(zeros))
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.xyz", zeros)
    for name in ("a.xyz.gz", "a.zip"):
        with pytest.raises(InputError, match="expected at most 100 times"):
            read_clouds(tmp_path / name)
    (tmp_path / "a.xyz.gz").write_bytes(gzip.compress(table(NEAR).encode())[:-9])
    with pytest.raises(InputError, match=r"a\.xyz\.gz: cannot be unpacked"):
        read_clouds(tmp_path / "a.xyz.gz")
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("b/a.xyz", "1 2 3\n1 2\n")
    with pytest.raises(InputError, match=r"a\.zip, b/a\.xyz, line 2: expected 3"):
        read_clouds(tmp_path / "a.zip")
    (tmp_path / "b.zip").write_bytes(b"PK")
    with pytest.raises(InputError, match="not a readable ZIP"):
        read_clouds(tmp_path / "b.zip")


def test_every_cloud_is_a_cloud(tmp_path: Path) -> None:
    (tmp_path / "a.pts").write_text("1\n1 2 3\n")
    assert isinstance(read_cloud(tmp_path / "a.pts"), PointCloud)
