"""Each format of poses, read back by the program that it is of, gives the same poses."""

import json
from pathlib import Path

import numpy as np
import pytest
from exported import component, placed

import mvreg
import mvreg.io
from mvreg.export.formats import PoseFormat
from mvreg.export.table import BY_NAME, FORMATS
from mvreg.geometry import se3

#: Of coordinates at five million, in the unit of the scans: doubles end at 1e-9.
CLOSE = 1e-8


@pytest.fixture
def one(rng):
    return component(rng)


def written(name, one, folder):
    """Write a format, and return where."""
    BY_NAME[name].write(folder, one, placed(one))
    return folder


def same(found, one, close=CLOSE):
    """The same poses, in the same order."""
    assert len(found) == len(one.poses)
    for pose, wanted in zip(found, one.poses.values(), strict=True):
        np.testing.assert_allclose(pose[:3, :3], wanted[:3, :3], atol=1e-12)
        np.testing.assert_allclose(pose[:3, 3], wanted[:3, 3], atol=close)


def names_in(path):
    return [line.split("\t")[2] for line in path.read_text().splitlines()]


def test_quaternions_are_those_of_scipy(rng):
    from scipy.spatial.transform import Rotation

    turns = [np.eye(3), np.diag([1.0, -1, -1]), se3.exp(np.array([0, 1e-9, 0, 0, 0, 0]))[:3, :3]]
    for turn in [*turns, *(se3.random(rng)[:3, :3] for _ in range(50))]:
        found = se3.quaternion(turn)
        wanted = Rotation.from_matrix(turn).as_quat()
        assert min(np.abs(found - wanted).max(), np.abs(found + wanted).max()) < 1e-15
        np.testing.assert_allclose(se3.rotation_from_quaternion(found), turn, atol=2e-15)


@pytest.mark.parametrize("name", ["matrix", "cloudcompare"])
def test_a_matrix_per_scan_is_read_by_numpy_bit_for_bit(name, one, tmp_path):
    """CloudCompare reads 16 numbers row by row, the translation at the end of each row."""
    written(name, one, tmp_path)
    files = {"a.ply": "a.txt", "b scan.ply": "b_scan.txt", "c.pcd": "c.txt"}
    assert {file.name for file in (tmp_path / name).iterdir()} == set(files.values())
    for scan, file in files.items():
        assert (np.loadtxt(tmp_path / name / file) == one.poses[scan]).all()


def test_all_matrices_in_one_text(one, tmp_path):
    written("matrices", one, tmp_path)
    stacked = np.loadtxt(tmp_path / "matrices.txt").reshape(-1, 4, 4)
    assert (stacked == np.stack(list(one.poses.values()))).all()
    assert BY_NAME["4x4"] is BY_NAME["matrices"]


@pytest.mark.parametrize(
    "each", [e for e in FORMATS if isinstance(e, PoseFormat) and e.read], ids=lambda e: e.name
)
def test_what_we_read_back_is_what_was_written(each, one, tmp_path):
    found = each.read(written(each.name, one, tmp_path))
    assert list(found) == list(one.poses)
    same(found.values(), one)


def test_meshlab_places_the_scans(one, tmp_path):
    pymeshlab = pytest.importorskip("pymeshlab", reason="needs pymeshlab")
    for name in one.poses:
        file = (tmp_path / name).with_suffix(".ply")
        mvreg.io.write_ply(file, np.eye(3))
        file.rename(tmp_path / name)
    # MeshLab goes by endings, and reads no PCD.
    renamed = type(one)(1, "a.ply", {n.replace("pcd", "ply"): p for n, p in one.poses.items()})
    mvreg.io.write_ply(tmp_path / "c.ply", np.eye(3))
    written("meshlab", renamed, tmp_path)
    meshes = pymeshlab.MeshSet()
    meshes.load_project(str(tmp_path / "meshlab.aln"))
    found = list(meshes)
    assert [mesh.label() for mesh in found] == list(renamed.poses)
    # Matrices of an .aln are read as floats of four bytes: half a unit at five million.
    same([mesh.transform_matrix() for mesh in found], renamed, close=0.5)


def test_evo_reads_tum(one, tmp_path):
    interface = pytest.importorskip("evo.tools.file_interface", reason="needs evo")
    written("tum", one, tmp_path)
    found = interface.read_tum_trajectory_file(str(tmp_path / "tum.txt"))
    same(found.poses_se3, one)
    assert found.timestamps.tolist() == [0, 1, 2]
    assert names_in(tmp_path / "tum_names.txt") == list(one.poses)


def test_evo_reads_kitti(one, tmp_path):
    interface = pytest.importorskip("evo.tools.file_interface", reason="needs evo")
    written("kitti", one, tmp_path)
    same(interface.read_kitti_poses_file(str(tmp_path / "kitti.txt")).poses_se3, one)
    assert names_in(tmp_path / "kitti_names.txt") == list(one.poses)


def test_open3d_reads_redwood(one, tmp_path):
    open3d = mvreg.load_open3d()
    written("redwood", one, tmp_path)
    read = open3d.io.read_pinhole_camera_trajectory(str(tmp_path / "redwood.log"))
    # Open3D keeps the inverse, from the world to the camera.
    same([np.linalg.inv(each.extrinsic) for each in read.parameters], one, close=1e-6)
    assert names_in(tmp_path / "redwood_names.txt") == list(one.poses)


def test_open3d_reads_the_pose_graph(one, tmp_path):
    open3d = mvreg.load_open3d()
    written("posegraph", one, tmp_path)
    graph = open3d.io.read_pose_graph(str(tmp_path / "posegraph.json"))
    same([node.pose for node in graph.nodes], one)
    assert [(e.source_node_id, e.target_node_id) for e in graph.edges] == [(1, 0), (2, 1)]
    assert [edge.confidence for edge in graph.edges] == [0.99, 0.75]
    for edge in graph.edges:
        source, target = graph.nodes[edge.source_node_id], graph.nodes[edge.target_node_id]
        np.testing.assert_allclose(target.pose @ edge.transformation, source.pose, atol=1e-6)
    assert names_in(tmp_path / "posegraph_names.txt") == list(one.poses)


def test_a_pose_graph_is_at_rest(rng, tmp_path):
    """Open3D's optimisation finds nothing to do: edges and nodes have the same direction."""
    open3d = mvreg.load_open3d()
    near = component(rng, offset=0.0)
    written("posegraph", near, tmp_path)
    graph = open3d.io.read_pose_graph(str(tmp_path / "posegraph.json"))
    open3d.pipelines.registration.global_optimization(
        graph,
        open3d.pipelines.registration.GlobalOptimizationLevenbergMarquardt(),
        open3d.pipelines.registration.GlobalOptimizationConvergenceCriteria(),
        open3d.pipelines.registration.GlobalOptimizationOption(reference_node=0),
    )
    same([node.pose for node in graph.nodes], near)


def test_colmap_reads_images(one, tmp_path):
    pycolmap = pytest.importorskip("pycolmap", reason="needs pycolmap")
    said = BY_NAME["colmap"].write(tmp_path, one, placed(one))
    assert said and "blanks" in said[0]
    read = pycolmap.Reconstruction(str(tmp_path / "colmap"))
    images = [read.images[number] for number in sorted(read.images)]
    assert [image.name for image in images] == ["a.ply", "b_scan.ply", "c.pcd"]
    worlds = [image.cam_from_world().inverse().matrix() for image in images]
    same(worlds, one, close=1e-6)


def test_nerfstudio_has_the_axes_of_opengl(one, tmp_path):
    """By its documentation: from camera to world, +X right, +Y up, and the camera looks along -Z.

    nerfstudio itself brings a deep-learning framework, which is too much for a test.
    """
    written("nerfstudio", one, tmp_path)
    frames = json.loads((tmp_path / "transforms.json").read_text())["frames"]
    assert [frame["file_path"] for frame in frames] == list(one.poses)
    ahead, down = np.array([0, 0, 1.0]), np.array([0, 1.0, 0])
    for frame, pose in zip(frames, one.poses.values(), strict=True):
        matrix = np.array(frame["transform_matrix"])
        np.testing.assert_allclose(-matrix[:3, 2], pose[:3, :3] @ ahead)
        np.testing.assert_allclose(-matrix[:3, 1], pose[:3, :3] @ down)
        np.testing.assert_array_equal(matrix[:, 3], pose[:, 3])
        assert np.linalg.det(matrix[:3, :3]) > 0


def test_the_document_has_every_format_and_no_other():
    import re

    page = Path(mvreg.__file__).parent / "export" / "README.md"
    listed = re.findall(r"^\| `([a-z0-9_]+)` \|", page.read_text(), re.MULTILINE)
    assert listed == [each.name for each in FORMATS]
