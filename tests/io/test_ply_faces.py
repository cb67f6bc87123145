"""The faces of PLY files, as several programs write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from experiments.fuzz.files import damaged, ply
from experiments.fuzz.points import FACES
from mvreg._open3d import load_open3d
from mvreg.errors import InputError
from mvreg.io.ply_faces import read_triangles
from mvreg.io.ply_header import read_header

KINDS = ("ascii", "binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("kind", KINDS)
def test_triangles(kind: str) -> None:
    data = ply(kind)
    np.testing.assert_array_equal(read_triangles(data, read_header(data, Path("a"))), FACES)
    assert read_triangles(data[:-9], read_header(data, Path("a"))) is None


def test_faces_of_several_sizes_with_more_lists() -> None:
    header = (
        "ply\nformat {} 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty uchar flag\n"
        "property list uchar float texcoord\nproperty list uchar int vertex_index\nend_header\n"
    )
    text = header.format("ascii").encode() + b"0 0 0\n\n1 1 1\n7 2 .5 .5 4 0 1 2 3\n7 0 3 4 5 6\n"
    binary = header.format("binary_little_endian").encode() + bytes(24)
    binary += (
        b"\7\2" + np.float32([0.5, 0.5]).tobytes() + b"\4" + np.arange(4, dtype="<i4").tobytes()
    )
    binary += b"\7\0\3" + np.array([4, 5, 6], "<i4").tobytes()
    for data in (text, binary):
        found = read_triangles(data, read_header(data, Path("a")))
        np.testing.assert_array_equal(found, [[0, 1, 2], [0, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize("ascii", [True, False])
def test_open3d(tmp_path: Path, ascii: bool) -> None:
    open3d = load_open3d()
    ball = open3d.geometry.TriangleMesh.create_sphere(1.0, 5)
    assert open3d.io.write_triangle_mesh(str(tmp_path / "a.ply"), ball, write_ascii=ascii)
    data = (tmp_path / "a.ply").read_bytes()
    found = read_triangles(data, read_header(data, Path("a")))
    np.testing.assert_array_equal(found, np.asarray(ball.triangles))


@pytest.mark.parametrize("kind", KINDS)
def test_damage_gives_triangles_or_none(kind: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(500):
        data = damaged(ply(kind), rng)
        try:
            header = read_header(data, Path("a"))
        except InputError:
            continue
        found = read_triangles(data, header)
        assert found is None or found.shape[1:] == (3,)
