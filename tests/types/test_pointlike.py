"""Whatever looks like points becomes a scan, and what does not is refused in words."""

import sys
import types

import numpy as np
import pandas
import pytest
import trimesh

import mvreg
from mvreg.errors import InputError
from mvreg.types import Scan
from mvreg.types.given import as_scans

POINTS = np.random.default_rng(0).normal(size=(20, 3))
SINGLE = POINTS.astype(np.float32)
COLOURS = np.random.default_rng(1).integers(0, 256, (20, 3), dtype=np.uint8)
BYTES = dict(zip(("red", "green", "blue"), COLOURS.T, strict=True))


def read_only():
    array = POINTS.copy()
    array.flags.writeable = False
    return array


class WithArray:
    def __array__(self, dtype=None, copy=None):
        return SINGLE


class WithInterface:
    def __init__(self):
        self.kept = POINTS
        self.__array_interface__ = POINTS.__array_interface__


class WithDLPack:
    def __dlpack__(self, **asked):
        return POINTS.__dlpack__(**asked)

    def __dlpack_device__(self):
        return POINTS.__dlpack_device__()


ARRAYS = {
    "doubles": (POINTS, POINTS),
    "single": (SINGLE, SINGLE),
    "half": (POINTS.astype(np.float16), POINTS.astype(np.float16)),
    "extended": (POINTS.astype(np.longdouble), POINTS),
    "whole": ((100 * POINTS).astype(np.int16), (100 * POINTS).astype(np.int16)),
    "unsigned": (np.abs(100 * POINTS).astype(np.uint8), np.abs(100 * POINTS).astype(np.uint8)),
    "Fortran": (np.asfortranarray(POINTS), POINTS),
    "read-only": (read_only(), POINTS),
    "strided": (np.repeat(POINTS, 2, axis=0)[::2], POINTS),
    "reversed": (POINTS[::-1], POINTS[::-1]),
    "columns of more": (np.hstack([POINTS, POINTS])[:, 1:4], np.hstack([POINTS, POINTS])[:, 1:4]),
    "big-endian": (POINTS.astype(">f8"), POINTS),
    "objects": (POINTS.astype(object), POINTS),
    "organised": (POINTS.reshape(4, 5, 3), POINTS),
    "no mask": (np.ma.array(POINTS), POINTS),
    "lists": (POINTS.tolist(), POINTS),
    "tuples": (tuple(map(tuple, POINTS)), POINTS),
    "list of arrays": (list(POINTS), POINTS),
    "memory": (memoryview(POINTS), POINTS),
    "__array__": (WithArray(), SINGLE),
    "__array_interface__": (WithInterface(), POINTS),
    "__dlpack__": (WithDLPack(), POINTS),
    "trimesh's arrays": (trimesh.caching.tracked_array(POINTS), POINTS),
    "pandas' values": (pandas.DataFrame(POINTS), POINTS),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_an_array_of_any_kind_becomes_doubles_of_its_own(name):
    given, expected = ARRAYS[name]
    scan = Scan("s", given)
    np.testing.assert_array_equal(scan.points, np.asarray(expected, dtype=np.float64))
    assert scan.points.dtype == np.dtype("=f8") and scan.points.flags.c_contiguous
    assert not scan.points.flags.writeable and not np.shares_memory(scan.points, POINTS)
    assert scan.attributes == {}
    POINTS[0, 0] += 0  # what was given may still be written to


def fields():
    table = np.zeros(20, [("X", ">f4"), ("y", "f8"), ("z", "f8"), ("intensity", "u2")])
    table["X"], table["y"], table["z"] = SINGLE[:, 0], POINTS[:, 1], POINTS[:, 2]
    table["intensity"] = np.arange(20)
    return table


def check(scan, colours=BYTES, **others):
    np.testing.assert_allclose(scan.points, POINTS, rtol=1e-6)
    assert set(scan.attributes) == {*colours, *others}
    for name, values in {**colours, **others}.items():
        np.testing.assert_allclose(scan.attributes[name], values, rtol=1e-6)
    assert all(scan.attributes[name].dtype == np.uint8 for name in colours)


def test_arrays_with_fields_and_mappings_keep_their_other_columns():
    check(Scan("s", fields()), {}, intensity=np.arange(20))
    check(Scan("s", {"points": POINTS, "colors": COLOURS / 255, "label": np.arange(20)}),
          label=np.arange(20))  # fmt: skip
    check(Scan("s", {axis: POINTS[:, k].tolist() for k, axis in enumerate("xyz")}), {})


def test_data_frames_go_by_the_names_of_their_columns():
    frame = pandas.DataFrame(POINTS[:, ::-1], columns=["Z", " y", "x"], index=range(40, 60))
    frame = frame.assign(R=COLOURS[:, 0], G=COLOURS[:, 1], B=COLOURS[:, 2], Intensity=0.5, who="me")
    scan = Scan("s", frame)
    check(scan, intensity=np.full(20, 0.5))
    check(Scan("s", frame.astype({"x": "Float64"})), intensity=np.full(20, 0.5))
    with pytest.raises(InputError, match="scan 's': expected columns x, y and z, found a, b; ren"):
        Scan("s", pandas.DataFrame({"a": [1], "b": [2]}))
    with pytest.raises(InputError, match="coordinates that are real numbers, got a column of"):
        Scan("s", frame.assign(x="east"))


def test_clouds_and_meshes_of_trimesh():
    check(Scan("s", trimesh.PointCloud(POINTS, colors=COLOURS)))
    check(Scan("s", trimesh.PointCloud(POINTS)), {})
    faces = np.arange(18).reshape(6, 3)
    mesh = trimesh.Trimesh(POINTS, faces, vertex_colors=COLOURS, process=False)
    check(Scan("s", mesh))
    check(Scan("s", trimesh.Trimesh(POINTS, faces, process=False)), {})
    with pytest.raises(InputError, match=r"expected a PointCloud or a Trimesh, got a Scene; of a"):
        Scan("s", trimesh.Scene(mesh))


@pytest.fixture(scope="module")
def open3d():
    return mvreg.load_open3d()


def test_clouds_and_meshes_of_open3d(open3d):
    geometry, vectors = open3d.geometry, open3d.utility.Vector3dVector
    cloud = geometry.PointCloud(vectors(POINTS))
    check(Scan("s", cloud), {})
    cloud.colors, cloud.normals = vectors(COLOURS / 255), vectors(np.tile([0.0, 0, 1], (20, 1)))
    up = {"nx": 0, "ny": 0, "nz": 1}
    check(Scan("s", cloud), **up)
    check(Scan("s", cloud.points), {})
    check(Scan("s", open3d.t.geometry.PointCloud.from_legacy(cloud)), **up)
    mesh = geometry.TriangleMesh(vectors(POINTS), open3d.utility.Vector3iVector([[0, 1, 2]]))
    mesh.vertex_colors = vectors(COLOURS / 255)
    check(Scan("s", mesh))
    check(Scan("s", open3d.t.geometry.TriangleMesh.from_legacy(mesh)))
    check(Scan("s", open3d.core.Tensor(POINTS)), {})
    tensors = open3d.t.geometry.PointCloud(open3d.core.Tensor(SINGLE))
    tensors.point.intensities = open3d.core.Tensor(np.arange(20.0)[:, None])
    check(Scan("s", tensors), {}, intensity=np.arange(20))
    with pytest.raises(InputError, match="expected a PointCloud or a TriangleMesh of Open3D, got"):
        Scan("s", geometry.LineSet())
    with pytest.raises(InputError, match="expected at least one point, got none"):
        Scan("s", geometry.PointCloud())
    with pytest.raises(InputError, match="expected at least one point, got none"):
        Scan("s", open3d.t.geometry.PointCloud())


def test_a_coarse_mesh_is_sampled_on_its_triangles(open3d):
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    box.visual = trimesh.visual.ColorVisuals(box, vertex_colors=np.tile(COLOURS[0], (8, 1)))
    legacy = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(box.vertices), open3d.utility.Vector3iVector(box.faces)
    )
    legacy.vertex_colors = open3d.utility.Vector3dVector(np.tile(COLOURS[0] / 255, (8, 1)))
    for mesh in (box, legacy, open3d.t.geometry.TriangleMesh.from_legacy(legacy)):
        scan = Scan("s", mesh)
        assert scan.points.shape == (20_000, 3)
        on_side = np.isclose(np.abs(scan.points) / [1.0, 1.5, 2.0], 1, rtol=1e-6).any(axis=1)
        assert on_side.all()
        facing = np.stack([scan.attributes[name] for name in ("nx", "ny", "nz")], axis=1)
        assert ((facing * scan.points).sum(axis=1) > 0.9).all()
        assert {int(value) for value in scan.attributes["red"]} == {int(COLOURS[0, 0])}


class FakeTensor:
    """What a tensor of torch does, on a GPU and with gradients."""

    __module__ = "torch"

    def __init__(self, steps=()):
        self.steps = steps

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.")

    def detach(self):
        return FakeTensor((*self.steps, "detach"))

    def cpu(self):
        return FakeTensor((*self.steps, "cpu"))

    def double(self):
        return FakeTensor((*self.steps, "double"))

    def numpy(self):
        assert {"detach", "cpu"} <= set(self.steps)
        return POINTS


def test_tensors_of_torch_need_be_neither_detached_nor_copied():
    check(Scan("s", FakeTensor()), {})


def test_none_of_the_libraries_is_imported(monkeypatch):
    for name in ("open3d", "trimesh", "pandas", "torch", "polars", "cupy"):
        monkeypatch.setitem(sys.modules, name, None)  # an import would fail
    check(Scan("s", FakeTensor()), {})
    check(Scan("s", types.SimpleNamespace(**{"__array_interface__": POINTS.__array_interface__})),
          {})  # fmt: skip


def test_given_attributes_come_before_those_that_were_found():
    scan = Scan("s", trimesh.PointCloud(POINTS, colors=COLOURS), attributes={"red": np.ones(20)})
    assert scan.attributes["red"].tolist() == [1.0] * 20
    np.testing.assert_array_equal(scan.attributes["blue"], BYTES["blue"])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (POINTS.T, r"points \(N, 3\), got \(3, 20\); a point is a row: pass array.T"),
        (np.ones((9, 4)), r"got \(9, 4\); pass array\[:, :3\], and what the other columns hold"),
        (np.ones((9, 2)), r"got \(9, 2\); mvreg registers points in space"),
        (np.ones(9), r"got \(9,\); if these are x, y, z, .*reshape\(-1, 3\)"),
        (POINTS.astype(complex), "expected real numbers, got an array of complex128"),
        (POINTS > 0, "expected real numbers, got an array of bool"),
        (POINTS.astype(str), "expected real numbers, got an array of <U"),
        (np.ma.masked_greater(POINTS, 1.0), r"without a mask, got \d+ masked numbers; drop"),
        ([[1, 2, 3], [4, 5]], "got a list with rows of different lengths"),
        ([["a", "b", "c"]], "expected real numbers, got an array of <U1"),
        ([[None, 1, 2]], "1 of 1 points are NaN"),
        ("scan.ply", "or mesh of Open3D or trimesh; got str 'scan.ply'"),
        (None, "got None"),
        (3.5, "got float 3.5"),
        ((row for row in POINTS), "got generator <.*; make a list of it"),
        (object(), "got object <object"),
        ({"x": [1, 2], "y": [1, 2], "z": [1]}, "x, y and z of one length, got x 2, y 2, z 1"),
        ({"x": [[1]], "y": [1], "z": [1]}, r"a number a point in a column, got an array \(1, 1\)"),
    ],
)  # fmt: skip
def test_what_does_not_look_like_points_is_refused_in_words(given, said):
    with pytest.raises(InputError, match=said) as caught:
        Scan("odd", given)
    assert str(caught.value).startswith("scan 'odd': ")


def test_an_array_elsewhere_says_to_copy_it():
    class Elsewhere:
        def __array__(self, dtype=None, copy=None):
            raise TypeError("can't convert device memory")

    with pytest.raises(InputError, match=r"in this computer's memory, got a .*Elsewhere .*copy it"):
        Scan("s", Elsewhere())


def test_a_mapping_gives_the_names_and_a_list_numbers():
    given = {"door": SINGLE, "window": Scan("other", POINTS)}
    assert [scan.name for scan in as_scans(given)] == ["door", "window"]
    assert [scan.name for scan in as_scans(iter([SINGLE, Scan("b", POINTS)]))] == ["scan_000", "b"]
    with pytest.raises(InputError, match="expected a mapping of names to scans, got the name 3, a"):
        as_scans({3: POINTS})


@pytest.mark.parametrize(
    "one", [POINTS, pandas.DataFrame(POINTS, columns=list("xyz")), trimesh.PointCloud(POINTS), 3],
    ids=lambda one: type(one).__name__,
)  # fmt: skip
def test_one_scan_instead_of_several_is_told(one):
    with pytest.raises(InputError, match=r"expected several scans, got one .*; pass a list"):
        mvreg.register(one)


def test_registration_of_whatever_it_is_gives_the_same_poses():
    scans = mvreg.dataset("tiny", views=3).scans
    plain = mvreg.register({scan.name: scan.points for scan in scans})
    others = {
        scans[0].name: trimesh.PointCloud(scans[0].points),
        scans[1].name: pandas.DataFrame(scans[1].points, columns=list("xyz")),
        scans[2].name: np.asfortranarray(scans[2].points),
    }
    found = mvreg.register(others)
    assert set(found.poses) == set(plain.poses) and len(found.poses) == 3
    for name, pose in plain.poses.items():
        np.testing.assert_array_equal(found.poses[name], pose)
