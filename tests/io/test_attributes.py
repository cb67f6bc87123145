"""What files say of each point besides its coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from mvreg._open3d import load_open3d
from mvreg.errors import InputError
from mvreg.io import PointCloud, read_cloud, write_ply_clouds
from mvreg.io.cloud_stream import ROWS
from mvreg.kernels.lzf import decompress

RNG = np.random.default_rng(5)
N = 500
POINTS = RNG.uniform(-9, 9, (N, 3)) + np.array([5e6, 0, 0])
COLOURS = RNG.integers(0, 256, (N, 3)).astype(np.uint8)
NORMALS = RNG.normal(size=(N, 3)).astype(np.float32)
INTENSITY = RNG.uniform(0, 1, N).astype(np.float32)
FIELDS = [("x", "f8"), ("y", "f8"), ("z", "f8"), ("red", "u1"), ("green", "u1"), ("blue", "u1"),
          ("nx", "f4"), ("ny", "f4"), ("nz", "f4"), ("intensity", "f4")]  # fmt: skip
PLY_TYPES = {"f8": "double", "f4": "float", "u1": "uchar"}


def table(order="<"):
    rows = np.empty(N, dtype=[(name, order + kind) for name, kind in FIELDS])
    columns = [*POINTS.T, *COLOURS.T, *NORMALS.T, INTENSITY]
    for (name, _), column in zip(FIELDS, columns, strict=True):
        rows[name] = column
    return rows


def ply(kind, body):
    properties = "".join(f"property {PLY_TYPES[kind]} {name}\n" for name, kind in FIELDS)
    return f"ply\nformat {kind} 1.0\nelement vertex {N}\n{properties}end_header\n".encode() + body


def pcd(kind, body, count=N):
    names, types = zip(*FIELDS, strict=True)
    header = (
        f"VERSION 0.7\nFIELDS {' '.join(names)}\nSIZE {' '.join(t[1] for t in types)}\n"
        f"TYPE {' '.join(t[0].upper() for t in types)}\nCOUNT {' '.join('1' for _ in names)}\n"
        f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {kind}\n"
    )
    return header.encode() + body


def lines():
    return "".join(" ".join(repr(v) for v in row) + "\n" for row in table().tolist()).encode()


def check(cloud):
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert list(cloud.attributes) == [name for name, _ in FIELDS[3:]]
    for name, expected in zip(("red", "green", "blue"), COLOURS.T, strict=True):
        assert cloud.attributes[name].dtype == np.uint8
        np.testing.assert_array_equal(cloud.attributes[name], expected)
    for name, expected in zip(("nx", "ny", "nz"), NORMALS.T, strict=True):
        np.testing.assert_array_equal(cloud.attributes[name], expected)
    np.testing.assert_array_equal(cloud.attributes["intensity"], INTENSITY)


def literal_runs(raw):
    """LZF that copies nothing: runs of at most 32 bytes as they are."""
    runs = [raw[i : i + 32] for i in range(0, len(raw), 32)]
    return b"".join(bytes([len(run) - 1]) + run for run in runs)


def compressed(raw, packed):
    return np.array([len(packed), len(raw)], "<u4").tobytes() + packed


def by_field():
    return b"".join(np.ascontiguousarray(table()[name]).tobytes() for name, _ in FIELDS)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("ascii.ply", ply("ascii", lines())),
        ("little.ply", ply("binary_little_endian", table().tobytes())),
        ("big.ply", ply("binary_big_endian", table(">").tobytes())),
        ("ascii.pcd", pcd("ascii", lines())),
        ("binary.pcd", pcd("binary", table().tobytes())),
        (
            "compressed.pcd",
            pcd("binary_compressed", compressed(by_field(), literal_runs(by_field()))),
        ),
        ("stored.pcd", pcd("binary_compressed", compressed(by_field(), by_field()))),
    ],
)
def test_that_every_scalar_comes_with_its_point(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    check(read_cloud(tmp_path / name))


def test_that_points_without_a_return_take_their_attributes_along(tmp_path):
    rows = table()
    rows["y"][::3] = np.nan
    (tmp_path / "a.ply").write_bytes(ply("binary_little_endian", rows.tobytes()))
    cloud = read_cloud(tmp_path / "a.ply")
    keep = np.arange(N) % 3 != 0
    np.testing.assert_array_equal(cloud.points, POINTS[keep])
    np.testing.assert_array_equal(cloud.attributes["red"], COLOURS[keep, 0])


@pytest.mark.parametrize("ascii", [True, False])
@pytest.mark.parametrize("packed", [True, False])
@pytest.mark.parametrize("kind", ["float32", "float64"])
def test_pcd_of_open3d(tmp_path, ascii, packed, kind):
    o3d = load_open3d()
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(POINTS.astype(kind)))
    cloud.point.colors = o3d.core.Tensor(COLOURS)
    cloud.point.intensity = o3d.core.Tensor(INTENSITY[:, None])
    path = tmp_path / "a.pcd"
    assert o3d.t.io.write_point_cloud(str(path), cloud, write_ascii=ascii, compressed=packed)
    found = read_cloud(path)
    rounding = 0.5 if kind == "float32" else 1e-3 if ascii else 0
    np.testing.assert_allclose(found.points, POINTS, atol=rounding, rtol=0)
    np.testing.assert_array_equal(
        np.stack([found.attributes[c] for c in ("red", "green", "blue")], axis=1), COLOURS
    )
    np.testing.assert_allclose(found.attributes["intensity"], INTENSITY, rtol=1e-5)


def test_names_of_other_writers(tmp_path):
    text = (
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar diffuse_red\nproperty uchar diffuse_green\n"
        "property uchar diffuse_blue\nproperty bool seen\nproperty uchar odd\nend_header\n"
        "1 2 3 10 20 30 1 0.5\n"
    )
    (tmp_path / "a.ply").write_text(text)
    values = read_cloud(tmp_path / "a.ply").attributes
    assert {name: column.item() for name, column in values.items()} == {
        "red": 10, "green": 20, "blue": 30, "seen": 1, "odd": 0.5,
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["ascii", "binary"])
def test_that_a_pcd_with_more_points_than_announced_is_refused(tmp_path, kind):
    path = tmp_path / "a.pcd"
    path.write_bytes(pcd(kind, lines() if kind == "ascii" else table().tobytes(), N - 3))
    with pytest.raises(InputError, match=r"a\.pcd: .*announces 497 points.*count is wrong"):
        read_cloud(path)


def test_that_zeros_after_the_points_of_a_pcd_are_padding(tmp_path):
    path = tmp_path / "a.pcd"
    path.write_bytes(pcd("binary", table().tobytes() + bytes(4096)))
    check(read_cloud(path))


def test_lzf():
    # "ab", then eight bytes from two before, then one run that reaches into itself from nine more
    packed = bytes([1]) + b"ab" + bytes([6 << 5, 1, 7 << 5, 3, 0])
    assert bytes(decompress(packed, 22)) == b"ab" * 5 + b"b" * 12
    assert decompress(packed, 21) is None
    assert decompress(packed, 23) is None
    assert decompress(packed[:-1], 22) is None
    assert decompress(bytes([32, 0]), 3) is None  # from before the beginning
    assert decompress(packed, 10**9) is None


def test_that_ply_written_piece_by_piece_is_read_back(tmp_path):
    many = ROWS + 7
    rng = np.random.default_rng(0)
    whole = PointCloud(
        rng.normal(size=(many, 3)) + 5e6,
        attributes={"red": rng.integers(0, 9, many).astype(np.uint8), "x": rng.normal(size=many),
                    "GPS time (s)": rng.normal(size=many), "n": np.arange(many)},
    )  # fmt: skip
    poor = PointCloud(np.zeros((3, 3)))
    kinds = {name: values.dtype for name, values in whole.attributes.items()}
    assert write_ply_clouds(tmp_path / "a.ply", iter([whole, poor]), kinds) == many + 3
    found = read_cloud(tmp_path / "a.ply")
    np.testing.assert_array_equal(found.points, [*whole.points, *poor.points])
    names = {"red": "red", "x": "x_2", "GPS time (s)": "GPS_time_s", "n": "n"}
    for name, word in names.items():
        np.testing.assert_array_equal(found.attributes[word][:many], whole.attributes[name])
        missing = 0 if name == "red" else np.nan
        np.testing.assert_array_equal(found.attributes[word][many:], missing)


def test_that_other_programs_read_what_is_written(tmp_path):
    o3d = load_open3d()
    values = dict(zip(("red", "green", "blue"), COLOURS.T, strict=True))
    values |= dict(zip(("nx", "ny", "nz"), NORMALS.T, strict=True)) | {"intensity": INTENSITY}
    kinds = {name: column.dtype for name, column in values.items()}
    write_ply_clouds(tmp_path / "a.ply", [PointCloud(POINTS, attributes=values)], kinds)
    cloud = o3d.t.io.read_point_cloud(str(tmp_path / "a.ply"))
    np.testing.assert_array_equal(cloud.point.positions.numpy(), POINTS)
    np.testing.assert_array_equal(cloud.point.colors.numpy(), COLOURS)
    np.testing.assert_array_equal(cloud.point.normals.numpy(), NORMALS)
    np.testing.assert_array_equal(cloud.point.intensity.numpy()[:, 0], INTENSITY)
