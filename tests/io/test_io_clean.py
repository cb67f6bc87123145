"""Clean text is read by a kernel, all else line by line: nobody can tell which it was."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import mvreg.io.obj
import mvreg.io.pcd
import mvreg.io.ply_ascii
import mvreg.io.stations
import mvreg.io.text_rows
from mvreg.errors import InputError
from mvreg.io import read_points
from mvreg.kernels.text import parse_rows

MODULES = (
    mvreg.io.obj, mvreg.io.pcd, mvreg.io.ply_ascii, mvreg.io.stations, mvreg.io.text_rows,
)  # fmt: skip
XYZ = "property float x\nproperty float y\nproperty float z\n"
PLY = "ply\nformat ascii 1.0\nelement vertex {n}\n" + XYZ
PCD = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {n}\nHEIGHT 1\nDATA ascii\n"
LIST = "property list uchar int l\n"
FACES = PLY + "element f 1\n" + LIST
#: Suffix, header, what begins a line, what parts its numbers, what ends it, and what follows.
LAYOUTS = {
    "ply": (".ply", PLY + "end_header\n", "", " ", "", ""),
    "ply with faces": (".ply", FACES + "end_header\n", "", " ", " ", "3 0 0 0\n"),
    "ply with lists": (".ply", PLY + LIST + "end_header\n", "", " ", " 2 8 9", ""),
    "xyz": (".xyz", "", "", "\t", " ", "\n\n"),
    "csv": (".csv", "x,y,z\n", "", ",", "", ""),
    "decimal commas": (".csv", "x;y;z\n", "", ";", "", ""),
    "pts": (".pts", "{n}\n", "", "  ", "", ""),
    "obj": (".obj", "# c\n", " v ", " ", "", "f 1 1 1\n"),
    "pcd": (".pcd", PCD, "", " ", "", ""),
}  # fmt: skip
BREAKS = [b"\n", b"\r", b" ", b"\0", b"\x1a", b"#", b"/", b",", b".", b"e", b"-", b"_", b"x",
          b"\xa0", b"\x1c", b"\x0b", b"7", b"nan", b"\n\n"]  # fmt: skip


def content(layout: str, rows: list[list[str]], newline: str = "\n") -> bytes:
    _, header, before, part, after, rest = LAYOUTS[layout]
    lines = "".join(f"{before}{part.join(row)}{after}\n" for row in rows)
    if layout == "decimal commas":
        lines = lines.replace(".", ",")
    whole = header.format(n=len(rows)) + lines + rest
    return whole.replace("\n", newline).encode()


def outcome(path: Path) -> list[list[float]] | str:
    try:
        points: list[list[float]] = read_points(path).tolist()
    except InputError as error:
        return str(error)
    return points


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_clean_files_are_read_by_the_kernel(
    tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch, layout: str,
    newline: str,
) -> None:  # fmt: skip
    points = rng.normal(size=(2000, 3))
    path = tmp_path / f"a{LAYOUTS[layout][0]}"
    path.write_bytes(content(layout, [list(map(repr, row)) for row in points.tolist()], newline))
    if layout != "ply with lists":
        for module in MODULES:
            monkeypatch.delattr(module, "parse_lines")
    np.testing.assert_array_equal(read_points(path), points)


@pytest.mark.parametrize("blank", [c for c in map(chr, range(256)) if c.isspace() and c != "\n"])
def test_any_blank_may_stand_before_a_vertex_of_an_obj(tmp_path: Path, blank: str) -> None:
    path = tmp_path / "a.obj"
    path.write_bytes(f"v 1 2 3\n{blank}{blank}v 4 5 6\nvn 0 0 1\n".encode("latin-1"))
    np.testing.assert_array_equal(read_points(path), [[1, 2, 3], [4, 5, 6]])


numbers = st.one_of(st.floats(-9, 9).map(repr), st.sampled_from(["1", "-2.5", "nan", "1e400"]))


@settings(
    max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    layout=st.sampled_from(sorted(LAYOUTS)),
    rows=st.lists(st.lists(numbers, min_size=3, max_size=3), min_size=1, max_size=4),
    newline=st.sampled_from(["\n", "\r\n", "\r"]),
    data=st.data(),
)
def test_damage_is_told_in_the_same_words(
    tmp_path: Path, layout: str, rows: list[list[str]], newline: str, data: st.DataObject
) -> None:
    damaged = bytearray(content(layout, rows, newline))
    for _ in range(data.draw(st.integers(0, 2))):
        at = data.draw(st.integers(0, len(damaged)))
        damaged[at : at + data.draw(st.integers(0, 3))] = data.draw(st.sampled_from(BREAKS))
    if data.draw(st.booleans()):
        del damaged[data.draw(st.integers(0, len(damaged))) :]
    path = tmp_path / f"a{LAYOUTS[layout][0]}"
    path.write_bytes(damaged)
    with pytest.MonkeyPatch.context() as patch:
        for module in MODULES:
            patch.setattr(module, "parse_rows", lambda *_: None)
        expected = outcome(path)
    assert MODULES[0].parse_rows is parse_rows
    assert outcome(path) == expected
