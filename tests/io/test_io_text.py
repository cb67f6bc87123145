"""Tables of text, as people and programs write them."""

from __future__ import annotations

import codecs
from pathlib import Path

import numpy as np
import pytest

from mvreg.errors import InputError, NoScanError
from mvreg.io import PointCloud, ReadOptions, read_clouds
from mvreg.io.text_numbers import numbers_in
from mvreg.types.column_names import axes_named

POINTS = np.array([[0.5, 1.25, -2.0], [18297.21, 29105.62, 39341.17], [-4.0, 8.0, 0.125]])


def read(path: Path, text: str | bytes, *columns: str) -> PointCloud:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    (cloud,) = read_clouds(path, ReadOptions(columns))
    return cloud


def table(form: str, *, decimal: str = ".") -> str:
    """A row per point; ``{i}`` is its number, ``{r}`` a word, ``{t}`` a number with thousands."""
    rows = []
    for i, (x, y, z) in enumerate(POINTS):
        row = form.format(x=x, y=y, z=z, i=i, r="wall", t=[f"{v:,}" for v in (x, y, z)])
        rows.append(row.replace(".", decimal))
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    "header",
    [
        "time,X,Y,Z", "t,X[mm],Y[mm],Z[mm]", "t,X_m,Y_m,Z_m", "t,x (m),y (m),z (m)",
        't,"Points_m_XYZ:0","Points_m_XYZ:1","Points_m_XYZ:2"', "t,Points:0,Points:1,Points:2",
        "t,Easting,Northing,Height", "t,E,N,H", "t,east [m],north [m],elevation [m]",
        "//t,X,Y,Z", "# t x y z", "# t, x, y, z", "#t\tx\ty\tz", "t;x;y;z", "t,PosX,PosY,PosZ",
        "t,pos_x,pos_y,pos_z", "t,Position.X,Position.Y,Position.Z", "t,x-coord,ycoord,zCoordinate",
        "t , 'x' , 'y' , 'z'", "# columns: t x y z", "t,x,y,altitude", "t,Rechtswert,Hochwert,Höhe",
    ],
)  # fmt: skip
def test_columns_are_found_by_name(tmp_path: Path, header: str) -> None:
    cloud = read(tmp_path / "a.csv", f"{header}\n" + table("{i},{x},{y},{z}"))
    np.testing.assert_array_equal(cloud.points, POINTS)
    (time,) = cloud.attributes.values()
    np.testing.assert_array_equal(time, [0, 1, 2])
    assert not cloud.remarks


@pytest.mark.parametrize(
    ("names", "axes"),
    [
        (["Northing", "Easting", "Height"], (1, 0, 2)),
        (["pixel_x", "pixel_y", "x", "y", "z"], (2, 3, 4)),
        (["x_local", "y_local", "z_local", "X", "Y", "Z"], (3, 4, 5)),
        (["nx", "ny", "nz", "x", "y", "z"], (3, 4, 5)),
        (["sensor_x", "sensor_y", "sensor_z", "utm_x", "utm_y", "utm_z"], (0, 1, 2)),
        (["a", "b", "c"], None),
        (["x", "y"], None),
        (["lat", "lon", "range"], None),
        (["tx", "ty", "tz"], None),
    ],
)
def test_names_of_axes(names: list[str], axes: tuple[int, ...] | None) -> None:
    assert axes_named(names) == axes


@pytest.mark.parametrize(
    ("form", "decimal"),
    [
        ("{t[0]} {t[1]} {t[2]}", "."),
        ("{t[0]};{t[1]};{t[2]}", "."),
        ('"{t[0]}","{t[1]}","{t[2]}"', "."),
        ("{x};{y};{z}", ","),
        ("{x} {y} {z}", ","),
        ('"{x}","{y}","{z}"', ","),
        ('"{x}";"{y}";"{z}"', "."),
        ('"{x}" "{y}" "{z}"', "."),
        ("{x}|{y}|{z}", "."),
        ("{x}\t{y}\t{z}\t", "."),
        ("{x}, {y}, {z},", "."),
        ("P{i} {x} {y} {z}", "."),
        ("{r},{x},{y},{z}", "."),
        ("left {r},{x},{y},{z}", "."),
        ("{x} {y} {z} {r}", "."),
        ("{x} {y} {z} {r} of the house", "."),
    ],
)
def test_numbers_are_read_as_they_are_written(tmp_path: Path, form: str, decimal: str) -> None:
    cloud = read(tmp_path / "a.txt", table(form, decimal=decimal))
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert not cloud.attributes and not cloud.remarks


@pytest.mark.parametrize(
    ("cells", "decimal", "groups"),
    [
        (["18,297.21", "5.5"], ".", ","),
        (["18.297,21", "5,5"], ",", "."),
        (["18'297.21"], ".", "'"),
        (["18 297,21"], ",", " "),
        (["1,234", "0,5"], ",", ""),
        (["1,234,567", "12"], ".", ","),
        (["wall, left", "1.5"], ".", ""),
    ],
)
def test_marks_of_decimals_and_thousands(cells: list[str], decimal: str, groups: str) -> None:
    found = numbers_in(cells)
    assert (found.decimal, found.groups) == (decimal, groups)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig"])
def test_text_with_a_mark_of_its_encoding(tmp_path: Path, encoding: str) -> None:
    marks = {"utf-16-le": codecs.BOM_UTF16_LE, "utf-16-be": codecs.BOM_UTF16_BE}
    text = ("x y z\r\n" + table("{x} {y} {z}")).encode(encoding)
    cloud = read(tmp_path / "a.txt", marks.get(encoding, b"") + text)
    np.testing.assert_array_equal(cloud.points, POINTS)


def test_text_that_belies_its_mark_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected text in utf-16"):
        read(tmp_path / "a.txt", codecs.BOM_UTF16_LE + b"1 2 3")


def test_columns_that_some_rows_lack_do_not_matter(tmp_path: Path) -> None:
    for text in (
        "1 2 3\n4 5 6 7 8 9.5\n",
        "1 2 3 7 8 9.5\n4 5 6\n",
        "1 2 3 7 8 9.5\n4 5 6 x - NaN\n",
    ):
        cloud = read(tmp_path / "a.xyz", text)
        np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [4, 5, 6]])
        assert all(np.isnan(values).sum() == 1 for values in cloud.attributes.values())
    with pytest.raises(InputError, match="line 2: expected at least 3 numbers, got 2: '4 5'"):
        read(tmp_path / "a.xyz", "1 2 3 7\n4 5\n")


def test_rows_without_coordinates_are_dropped_and_counted(tmp_path: Path) -> None:
    cloud = read(tmp_path / "a.csv", "id,x,y,z\n1,1,2,3\n2,,,\n3,NA,null,-\n4,4,5,6\n")
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(cloud.attributes["id"], [1, 4])
    assert cloud.remarks == ("left out 2 of 4 rows without coordinates",)


def test_attributes_have_the_names_of_ply_or_their_own(tmp_path: Path) -> None:
    header = "X,Y,Z,R,G,B,Scalar_Intensity,Nx,return number,Label,empty\n"
    cloud = read(tmp_path / "a.csv", header + "1,2,3,0,128,255,0.5,1,2,wall,\n" * 3)
    assert list(cloud.attributes) == [
        "red", "green", "blue", "intensity", "nx", "return number"
    ]  # fmt: skip
    assert cloud.attributes["blue"].dtype == np.uint8
    assert cloud.attributes["blue"].tolist() == [255] * 3


@pytest.mark.parametrize(
    ("rest", "names"),
    [
        ("10 20 255", ["red", "green", "blue"]),
        ("0.5 10 20 255", ["intensity", "red", "green", "blue"]),
        ("10 20 255 0.5", ["red", "green", "blue", "column_7"]),
        ("0.1 0.2 0.7", ["column_4", "column_5", "column_6"]),
        ("0.48 -0.6 0.64", ["nx", "ny", "nz"]),
        ("0 1 1", ["column_4", "column_5", "column_6"]),
        ("10 20 300", ["column_4", "column_5", "column_6"]),
        ("7", ["column_4"]),
    ],
)
def test_colours_without_a_name(tmp_path: Path, rest: str, names: list[str]) -> None:
    cloud = read(tmp_path / "a.xyz", f"1.5 2 3 {rest}\n" * 3)
    assert list(cloud.attributes) == names


@pytest.mark.parametrize(
    ("top", "kind", "last"),
    [("255", "uint8", 255), ("65535", "uint16", 65535), ("1.0", "uint8", 255)],
)
def test_colours_of_bytes_words_and_shares(tmp_path: Path, top: str, kind: str, last: int) -> None:
    half = "0.5" if "." in top else "1"
    cloud = read(tmp_path / "a.csv", "x,y,z,red,green,blue\n" + f"1,2,3,0,{half},{top}\n" * 2)
    assert cloud.attributes["blue"].dtype == kind
    assert cloud.attributes["blue"].tolist() == [last, last]


def grid(form: str) -> str:
    rng = np.random.default_rng(0)
    return "".join(
        form.format(*rng.normal(size=3), i=i, row=i // 10, col=i % 10) + "\n" for i in range(100)
    )


@pytest.mark.parametrize(
    ("form", "said"),
    [
        ("{row} {col} {:.4f} {:.4f} {:.4f}", "columns 1 and 2 count as rows and columns do"),
        ("{row} {col} {:.4f} {:.4f} {:.4f} 128", "columns 1 and 2 count as rows and columns do"),
        ("{i} {:.4f} {:.4f} {:.4f}", "column 1 counts the rows"),
        ("{i}.5 {:.4f} {:.4f} {:.4f}", "column 1 grows evenly as a time does"),
    ],
)
def test_columns_that_are_hardly_coordinates_are_remarked(
    tmp_path: Path, form: str, said: str
) -> None:
    (remark,) = read(tmp_path / "a.xyz", grid(form)).remarks
    assert said in remark and "took columns 1, 2 and 3 of " in remark
    assert "dataset.columns=[_,_,x,y,z]" in remark


@pytest.mark.parametrize(
    "form",
    [
        "{row} {col} {:.4f}", "{row} {col} {:.4f} 9", "{:.4f} {:.4f} {:.4f} {i}",
        "{row} {col} {i} 7 8 9", "{i} {i} {i}",
    ],
)  # fmt: skip
def test_height_maps_and_whole_numbers_are_coordinates(tmp_path: Path, form: str) -> None:
    assert not read(tmp_path / "a.xyz", grid(form)).remarks


def test_a_header_that_names_no_axes_is_remarked(tmp_path: Path) -> None:
    (remark,) = read(tmp_path / "a.csv", "a,b,c,d\n1,2,3,4\n5,6,7,8\n").remarks
    assert "its header says a, b, c, d" in remark


@pytest.mark.parametrize("columns", [("_", "_", "x", "y", "z"), ("row", "col", "X", "Y", "Z", "i")])
def test_columns_can_be_told(tmp_path: Path, columns: tuple[str, ...]) -> None:
    text = "time,x,y,z,a,b\n" + table("7 8 {x} {y} {z} 9")
    cloud = read(tmp_path / "a.txt", text, *columns)
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert list(cloud.attributes) == [c for c in columns if c not in "_XYZxyz"]
    assert not cloud.remarks


@pytest.mark.parametrize("columns", [("a", "b"), ("x", "y"), ("x", "x", "y", "z")])
def test_columns_without_axes_are_refused(tmp_path: Path, columns: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=r"dataset\.columns=\[.*: expected the names of the col"):
        read(tmp_path / "a.txt", "1 2 3\n", *columns)


def test_more_columns_told_than_there_are(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"line 2: expected 4 columns, as dataset\.columns says, got"
    ):
        read(tmp_path / "a.txt", "# c\n1 2 3\n", "_", "x", "y", "z")


POSE = np.array([[0, -1, 0, 5.0], [1, 0, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]])


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(" ".join(map(str, row)) for row in POSE) + "\n",
        " ".join(map(str, POSE.ravel()[:12])) + "\n",
        "1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0 0 0.6 0.8\n",
        "t,x,y,z,qx,qy,qz,qw\n1,1,2,3,0,0,0,2\n",
        "Scanned on a turntable, 6 steps.\n",
        "",
    ],
)
def test_poses_and_notes_are_no_scans(tmp_path: Path, text: str) -> None:
    with pytest.raises(NoScanError, match="expected"):
        read(tmp_path / "a.txt", text)


def test_the_first_line_that_could_not_be_used_is_shown(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"line 3: expected .* got '12 words and 7 more'"):
        read(tmp_path / "a.txt", "# c\nnotes\n12 words and 7 more\nno\n")


def test_a_header_with_numbers_in_it_is_passed_over(tmp_path: Path) -> None:
    text = "Scan 1 of 6, 2024 03 05\nsize 640 480 30 fps\n" + table("{x} {y} {z}")
    np.testing.assert_array_equal(read(tmp_path / "a.txt", text).points, POINTS)
