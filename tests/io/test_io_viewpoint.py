"""What a PCD file says of the sensor, and that the points stay where they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mvreg._open3d import load_open3d
from mvreg.errors import InputError
from mvreg.io import read_cloud, read_points, write_ply

POINTS = np.array([[1.0, 2, 3], [4, 5, 6]])
HEADER = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n{}"


def pcd(path: Path, view_point: str | None, data: str = "ascii") -> Path:
    """Two points, below a header with this VIEWPOINT; with none if that is None."""
    line = "" if view_point is None else f"VIEWPOINT {view_point}\n"
    header = HEADER.format(line) + f"POINTS 2\nDATA {data}\n"
    body = b"1 2 3\n4 5 6\n" if data == "ascii" else POINTS.astype("<f4").tobytes()
    path.write_bytes(header.encode() + body)
    return path


@pytest.mark.parametrize("data", ["ascii", "binary"])
@pytest.mark.parametrize(
    ("said", "known"),
    [
        ("1.5 -2 3e1 1 0 0 0", [1.5, -2, 30]),
        ("0 0 0.1 0.5 0.5 0.5 0.5", [0, 0, 0.1]),
        # At the origin, as somebody has said who turned the axes.
        ("0 0 0 0 1 0 0", [0, 0, 0]),
        ("0 0 0 1 0 0 0", None),
        ("0.0 -0.0 0 1.000 0 0 0", None),
        ("0 0 0 0 0 0 0", None),
        (None, None),
    ],
)
def test_the_translation_is_the_sensor_s_position_unless_all_is_default(
    tmp_path: Path, said: str | None, known: list[float] | None, data: str
) -> None:
    cloud = read_cloud(pcd(tmp_path / "a.pcd", said, data))
    np.testing.assert_array_equal(cloud.points, POINTS)
    if known is None:
        assert cloud.view_point is None
    else:
        np.testing.assert_allclose(cloud.view_point, known)


def test_compressed_points_have_it_too_and_stay_where_they_are(tmp_path: Path) -> None:
    open3d = load_open3d()
    points = POINTS.repeat(50, axis=0)
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    path = tmp_path / "a.pcd"
    assert open3d.io.write_point_cloud(str(path), cloud, compressed=True)
    assert read_cloud(path).view_point is None, "Open3D writes the default"
    said = path.read_bytes().replace(b"VIEWPOINT 0 0 0 1 0 0 0", b"VIEWPOINT 7 8 9 0 1 0 0")
    path.write_bytes(said)
    found = read_cloud(path)
    np.testing.assert_array_equal(found.view_point, [7, 8, 9])
    np.testing.assert_array_equal(found.points, points)


@pytest.mark.parametrize(
    "said", ["", "0 0 0", "1 2 3 1 0 0 0 0", "1 2 x 1 0 0 0", "nan 0 0 1 0 0 0"]
)
def test_what_is_no_pose_is_refused(tmp_path: Path, said: str) -> None:
    path = pcd(tmp_path / "a.pcd", said)
    with pytest.raises(InputError, match=r"a\.pcd: expected VIEWPOINT with 7 numbers, tx ty tz qw"):
        read_points(path)


def test_other_formats_say_nothing(tmp_path: Path) -> None:
    write_ply(tmp_path / "a.ply", POINTS)
    np.savetxt(tmp_path / "a.xyz", POINTS)
    np.save(tmp_path / "a.npy", POINTS)
    for name in ("a.ply", "a.xyz", "a.npy"):
        cloud = read_cloud(tmp_path / name)
        assert cloud.view_point is None
        np.testing.assert_array_equal(cloud.points, read_points(tmp_path / name))
