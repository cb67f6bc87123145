"""Meshes: their vertices, or points on their triangles where these are too coarse."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mvreg._open3d import load_open3d
from mvreg.geometry.nearest import build_tree, nearest
from mvreg.geometry.triangles import ENOUGH
from mvreg.io import PointCloud, read_cloud, read_points
from mvreg.io.mesh_points import with_points_on_triangles
from mvreg.io.stl import read_stl

CORNERS = np.array([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0], [0, 0, 1.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]])


def test_points_are_spread_evenly_over_triangles() -> None:
    cloud = with_points_on_triangles(PointCloud(CORNERS, triangles=FACES))
    points = cloud.points
    assert len(points) == ENOUGH
    assert cloud.remarks[0].startswith("5 vertices, sampled at 20,000 points on 3 triangles")
    wall = points[:, 0] == 0
    assert abs(np.count_nonzero(wall) / ENOUGH - 1 / 9) < 0.01
    spacing = np.sqrt(9 / ENOUGH)
    grid = np.stack(np.meshgrid(np.linspace(0, 4, 200), np.linspace(0, 2, 100)), -1).reshape(-1, 2)
    there, _ = nearest(build_tree(points), np.c_[grid, np.zeros(len(grid))])
    assert there.max() < 3 * spacing
    np.testing.assert_allclose(
        np.abs([cloud.attributes[n] for n in ("nx", "nz")]).T[wall], [[1, 0]] * wall.sum()
    )


def test_the_same_points_whatever_the_unit() -> None:
    one = with_points_on_triangles(PointCloud(CORNERS, triangles=FACES)).points
    other = with_points_on_triangles(PointCloud(CORNERS * 1024, triangles=FACES)).points
    np.testing.assert_array_equal(one * 1024, other)


def test_a_fine_mesh_keeps_its_vertices() -> None:
    n = 60
    u, v = np.meshgrid(np.arange(n), np.arange(n))
    points = np.stack([u, v, np.sin(u / 9)], -1).reshape(-1, 3).astype(float)
    at = np.arange(n * n).reshape(n, n)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:]], -1).reshape(-1, 4)
    faces = np.concatenate([quads[:, :3], quads[:, [2, 1, 3]]])
    cloud = PointCloud(points, triangles=faces)
    assert with_points_on_triangles(cloud) is cloud
    scattered = PointCloud(points, triangles=faces[:20])
    assert with_points_on_triangles(scattered) is scattered


def test_colours_are_interpolated_and_classes_dropped() -> None:
    cloud = PointCloud(
        CORNERS,
        attributes={"red": np.array([0, 200, 200, 0, 0], np.uint8), "class": np.arange(5)},
        triangles=FACES,
    )
    found = with_points_on_triangles(cloud)
    assert set(found.attributes) == {"red", "nx", "ny", "nz"}
    assert found.attributes["red"].dtype == np.uint8
    np.testing.assert_allclose(found.attributes["red"], found.points[:, 0] * 50, atol=0.51)


@pytest.mark.parametrize(
    "faces", [[[0, 0, 0]], [[0, 1, 99]], [[0, 1, -1]], np.empty((0, 3), int), [[0, 1, 5]]]
)
def test_triangles_that_are_none_do_not_count(faces: object) -> None:
    points = np.vstack([CORNERS, [[np.nan] * 3]])
    cloud = PointCloud(points, triangles=np.array(faces))
    assert with_points_on_triangles(cloud) is cloud


def test_the_sensor_is_where_the_triangles_face() -> None:
    open3d = load_open3d()
    ball = open3d.geometry.TriangleMesh.create_sphere(1.0, 12)
    points, faces = np.asarray(ball.vertices), np.asarray(ball.triangles)
    front = faces[points[faces].mean(axis=1) @ [0, 0.6, 0.8] > 0.1]
    used, which = np.unique(front, return_inverse=True)
    half = PointCloud(points[used], triangles=which.reshape(-1, 3))
    sensor = with_points_on_triangles(half).view_point
    assert sensor is not None
    assert sensor @ [0, 0.6, 0.8] / np.linalg.norm(sensor) > np.cos(np.radians(10))
    whole = with_points_on_triangles(PointCloud(points, triangles=faces))
    assert whole.view_point is None
    told = with_points_on_triangles(PointCloud(points, np.ones(3), triangles=faces))
    np.testing.assert_array_equal(told.view_point, np.ones(3))


@pytest.mark.parametrize("suffix", ["stl", "obj", "off"])
@pytest.mark.parametrize("ascii", [True, False])
def test_open3d_meshes(tmp_path: Path, suffix: str, ascii: bool) -> None:
    open3d = load_open3d()
    box = open3d.geometry.TriangleMesh.create_box(2, 1, 0.5)
    box.compute_triangle_normals()
    path = tmp_path / f"a.{suffix}"
    if suffix == "stl" and ascii:
        lines = ["solid a"]
        for corners in np.asarray(box.vertices)[np.asarray(box.triangles)]:
            lines += ["facet normal 0 0 1", " outer loop"]
            lines += [f"  vertex {x} {y} {z}" for x, y, z in corners.tolist()]
            lines += [" endloop", "endfacet"]
        path.write_text("\n".join([*lines, "endsolid a"]))
    else:
        assert open3d.io.write_triangle_mesh(str(path), box, write_ascii=ascii)
    cloud = read_cloud(path)
    assert cloud.remarks[0].startswith("8 vertices, sampled at 20,000 points on 12 triangles")
    np.testing.assert_allclose(cloud.points.max(axis=0), [2, 1, 0.5], atol=0.03)
    assert np.all(cloud.points.min(axis=0) >= 0)


def test_stl_corners_come_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    record = np.zeros(3, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    record["corners"] = CORNERS[FACES]
    (tmp_path / "a.stl").write_bytes(
        b"solid, though binary".ljust(80) + b"\3\0\0\0" + record.tobytes()
    )
    cloud = read_stl(tmp_path / "a.stl")
    np.testing.assert_array_equal(cloud.points, CORNERS)
    np.testing.assert_array_equal(cloud.triangles, FACES)


def test_obj_polygons_and_negative_indices(tmp_path: Path) -> None:
    rows = "".join(f"v {x} {y} {z} 0.5 0 1\n" for x, y, z in CORNERS[:4].tolist())
    (tmp_path / "a.obj").write_text(rows + "f -4//1 -3//1 3/2/1 4\n")
    cloud = read_cloud(tmp_path / "a.obj")
    assert len(cloud.points) == ENOUGH
    assert set(cloud.attributes["red"].tolist()) == {128}
    assert cloud.points[:, :2].max(axis=0) == pytest.approx([4, 2], abs=0.05)


def test_off_with_colours_and_comments(tmp_path: Path) -> None:
    rows = "".join(f"{x} {y} {z} 255 0 7 255\n" for x, y, z in CORNERS.tolist())
    (tmp_path / "a.off").write_text("COFF # a\n# b\n\n5 0 0\n" + rows)
    cloud = read_cloud(tmp_path / "a.off")
    np.testing.assert_array_equal(read_points(tmp_path / "a.off"), CORNERS)
    np.testing.assert_array_equal(cloud.attributes["blue"], [7] * 5)
