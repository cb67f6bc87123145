"""NumPy's files, in the shapes that people save points in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mvreg.errors import InputError, NoScanError
from mvreg.io import PointCloud, read_cloud

POINTS = np.random.default_rng(0).normal(size=(60, 3))
COLOURS = np.random.default_rng(1).integers(0, 256, size=(60, 3), dtype=np.uint8)


def saved(path: Path, array: np.ndarray) -> PointCloud:
    np.save(path / "a.npy", array)
    return read_cloud(path / "a.npy")


def packed(path: Path, **arrays: np.ndarray) -> PointCloud:
    np.savez(path / "a.npz", **arrays)
    return read_cloud(path / "a.npz")


def fields(**columns: np.ndarray) -> np.ndarray:
    kinds = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
    array = np.zeros(len(POINTS), dtype=kinds)
    for name, column in columns.items():
        array[name] = column
    return array


@pytest.mark.parametrize("names", ["xyz", "XYZ", ("pos_x", "pos_y", "pos_z")])
def test_fields_are_found_by_name_and_others_are_kept(tmp_path: Path, names: str) -> None:
    columns = {"t": np.arange(60.0), **dict(zip(names, POINTS.T, strict=True))}
    columns |= {"intensity": np.ones(60, np.float32), "seen": np.ones(60, bool)}
    cloud = saved(tmp_path, fields(**columns))
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert {name: values.dtype.name for name, values in cloud.attributes.items()} == {
        "t": "float64", "intensity": "float32", "seen": "uint8",
    }  # fmt: skip


def test_a_field_may_be_a_vector(tmp_path: Path) -> None:
    cloud = saved(tmp_path, fields(xyz=POINTS, rgb=COLOURS).reshape(6, 10))
    np.testing.assert_array_equal(cloud.points, POINTS)
    np.testing.assert_array_equal(cloud.attributes["green"], COLOURS[:, 1])


@pytest.mark.parametrize("name", ["points", "positions", "xyz", "vertices", "Points"])
def test_arrays_are_found_by_name(tmp_path: Path, name: str) -> None:
    more = {"colors": COLOURS / 255, "normals": POINTS, "reflectance": POINTS[:, 0]}
    cloud = packed(tmp_path, pose=np.eye(4), faces=np.zeros((9, 3), int), **{name: POINTS}, **more)
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert sorted(cloud.attributes) == sorted(
        ["red", "green", "blue", "nx", "ny", "nz", "reflectance"]
    )
    np.testing.assert_array_equal(cloud.attributes["blue"], COLOURS[:, 2])


def test_coordinates_in_three_arrays_organised_too(tmp_path: Path) -> None:
    x, y, z = (column.reshape(6, 10) for column in POINTS.T)
    cloud = packed(tmp_path, x=x, y=y, z=z, intensity=np.ones((6, 10)))
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert list(cloud.attributes) == ["intensity"]
    with pytest.raises(InputError, match="expected x, y and z of one shape"):
        packed(tmp_path, x=x, y=y, z=z[1:])


def test_points_in_columns_are_turned_with_a_remark(tmp_path: Path) -> None:
    for array, names in [
        (POINTS.T, []),
        (np.hstack([POINTS, COLOURS]).T, ["red", "green", "blue"]),
    ]:
        cloud = saved(tmp_path, array)
        np.testing.assert_array_equal(cloud.points, POINTS)
        assert "a point in each column" in cloud.remarks[0]
        assert list(cloud.attributes) == names


def test_an_organised_cloud_lacks_what_is_nan(tmp_path: Path) -> None:
    organised = np.dstack([POINTS.reshape(6, 10, 3), np.arange(60.0).reshape(6, 10)])
    organised[2, 3, :3] = np.nan
    cloud = saved(tmp_path, organised)
    kept = np.arange(60) != 23
    np.testing.assert_array_equal(cloud.points, POINTS[kept])
    np.testing.assert_array_equal(cloud.attributes["column_4"], np.arange(60)[kept])


@pytest.mark.parametrize(
    ("array", "error"),
    [
        (np.eye(4), NoScanError),
        (np.eye(4)[:3], NoScanError),
        (np.eye(3), NoScanError),
        (np.zeros((8, 8, 3), np.uint8), InputError),
        (np.zeros((480, 640)), InputError),
    ],
)
def test_matrices_and_images_are_no_scans(
    tmp_path: Path, array: np.ndarray, error: type[InputError]
) -> None:
    with pytest.raises(error, match="expected"):
        saved(tmp_path, array)


def test_half_precision_is_remarked(tmp_path: Path) -> None:
    (remark,) = saved(tmp_path, (100 * POINTS).astype(np.float16)).remarks
    assert "half precision, steps of up to 0.125" in remark or "0.25" in remark
    assert not saved(tmp_path, POINTS.astype(np.float32)).remarks
