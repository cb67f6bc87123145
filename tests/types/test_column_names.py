"""Columns go by the same names in files and in tables in memory."""

from __future__ import annotations

import numpy as np
import pandas
import pytest

from mvreg import Scan
from mvreg.io import read_cloud
from mvreg.types.column_names import coordinates_named

RNG = np.random.default_rng(5)
POINTS = RNG.normal(size=(50, 3)).round(3)
COLOURS = RNG.integers(0, 256, (50, 3))
HEADINGS = {
    "plain": ["x", "y", "z", "intensity", "red", "green", "blue"],
    "capitals": ["X", "Y", "Z", "Intensity", "R", "G", "B"],
    "units": ["X[m]", "Y[m]", "Z[m]", "Amplitude[dB]", "red", "green", "blue"],
    "CloudCompare": ["//X", "Y", "Z", "Scalar_Intensity", "R", "G", "B"],
    "map": ["Easting", "Northing", "Height", "Time (s)", "r", "g", "b"],
    "ParaView": ["Points_m_XYZ:0", "Points_m_XYZ:1", "Points_m_XYZ:2", "a", "b", "c", "d"],
    "normals": ["x", "y", "z", "time", "Normal_X", "Normal_Y", "Normal_Z"],
    "last": ["time", "red", "green", "blue", "x", "y", "z"],
}


def table(names):
    columns = dict(zip(names, np.c_[POINTS, POINTS[:, 0] * 2, COLOURS].T, strict=True))
    if names[4:] == ["x", "y", "z"]:
        columns = dict(zip(names, np.c_[POINTS[:, 0], COLOURS, POINTS].T, strict=True))
    return pandas.DataFrame(columns)


@pytest.mark.parametrize("which", HEADINGS)
@pytest.mark.parametrize("kind", ["csv", "npz", "fields"])
def test_that_files_and_tables_go_by_the_same_names(tmp_path, which, kind):
    frame = table(HEADINGS[which])
    if kind == "csv":
        frame.to_csv(tmp_path / "a.csv", index=False)
        cloud = read_cloud(tmp_path / "a.csv")
    elif kind == "npz":
        np.savez(tmp_path / "a.npz", **{name: frame[name].to_numpy() for name in frame})
        cloud = read_cloud(tmp_path / "a.npz")
    else:
        np.save(tmp_path / "a.npy", frame.to_records(index=False))
        cloud = read_cloud(tmp_path / "a.npy")
    for given in (frame, frame.to_records(index=False), dict(frame.items())):
        scan = Scan("s", given)
        np.testing.assert_array_equal(scan.points, cloud.points)
        np.testing.assert_array_equal(scan.points, POINTS)
        assert list(scan.attributes) == list(cloud.attributes)
        for name, values in scan.attributes.items():
            np.testing.assert_array_equal(values, cloud.attributes[name])


def test_that_packed_colours_are_unpacked_in_memory_too():
    packed = (COLOURS @ [1 << 16, 1 << 8, 1]).astype(np.uint32)
    kinds = [("x", "f4"), ("y", "f4"), ("z", "f4"), ("rgb", "f4")]
    cloud = np.zeros(50, kinds)
    for axis, column in zip("xyz", POINTS.T, strict=True):
        cloud[axis] = column
    cloud["rgb"] = packed.view(np.float32)
    scan = Scan("s", cloud)
    found = np.column_stack([scan.attributes[name] for name in ("red", "green", "blue")])
    np.testing.assert_array_equal(found, COLOURS)


@pytest.mark.parametrize(
    ("names", "whole", "found"),
    [
        (["points", "x", "y", "z"], {"points"}, "points"),
        (["position", "x", "y", "z"], (), (1, 2, 3)),
        (["time", "POS"], {"POS"}, "POS"),
        (["pts"], (), "pts"),
        (["a", "b", "c"], (), None),
    ],
)
def test_that_one_array_of_points_comes_before_three_columns(names, whole, found):
    assert coordinates_named(names, whole) == found
