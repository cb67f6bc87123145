"""PLY: every layout reads back the same, and every kind of damage is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mvreg.errors import InputError
from mvreg.io import read_points, write_ply
from mvreg.io.ply import read_ply

CODES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
         "float": "f4", "double": "f8", "int16": "i2", "float64": "f8"}  # fmt: skip
quick = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def ply(path: Path, header: str, body: bytes | str, newline: str = "\n") -> Path:
    text = newline.join(["ply", *header.strip().splitlines(), "end_header", ""])
    content = text.encode("latin-1")
    path.write_bytes(content + (body.encode() if isinstance(body, str) else body))
    return path


def ascii_ply(path: Path, body: str, count: int = 3, rest: str = "") -> Path:
    header = f"format ascii 1.0\nelement vertex {count}\n"
    header += "property float x\nproperty float y\nproperty float z\n" + rest
    return ply(path, header, body)


class Layout:
    """A PLY file drawn at random: which elements, properties, types, and which values."""

    def __init__(self, draw: st.DrawFn) -> None:
        self.format = draw(st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"]))
        self.newline = draw(st.sampled_from(["\n", "\r\n", "\r"]))
        extra = draw(st.lists(st.sampled_from(["nx", "red", "quality"]), unique=True))
        names = draw(st.permutations(["x", "y", "z", *extra]))
        self.vertex = [(name, draw(st.sampled_from(["float", "double", "float64"]))
                        if name in "xyz" else draw(st.sampled_from(sorted(CODES))))
                       for name in names]  # fmt: skip
        self.list_at = draw(st.none() | st.integers(0, len(names)))
        self.before = draw(st.integers(0, 3))
        self.after = draw(st.integers(0, 3))
        values = st.floats(-1e6, 1e6, width=32)
        shape = hnp.array_shapes(min_dims=1, max_dims=1, max_side=6)
        count = draw(shape)[0]
        self.points = draw(hnp.arrays(np.float64, (count, 3), elements=values))
        self.lists = draw(st.lists(st.lists(st.integers(0, 9), max_size=4), min_size=count,
                                   max_size=count))  # fmt: skip

    def header(self) -> str:
        lines = ["comment any", f"format {self.format} 1.0", "obj_info num_cols 4", "bye", ""]
        if self.before:
            lines += [f"element range_grid {self.before}",
                      "property list uchar int vertex_indices"]  # fmt: skip
        lines += [f"element vertex {len(self.points)}"]
        vertex = [f"property {kind} {name}" for name, kind in self.vertex]
        if self.list_at is not None:
            vertex.insert(self.list_at, "property list ushort short weights")
        lines += vertex
        if self.after:
            lines += [f"element face {self.after}", "property list uchar int vertex_indices"]
        return "\n".join(lines)

    def body(self) -> bytes:
        records = [self._list("uchar", "int", [1, 2, 3][:i]) for i in range(self.before)]
        for point, weights in zip(self.points, self.lists, strict=True):
            values = dict(zip("xyz", point, strict=True))
            parts = [self._item(kind, values.get(name, 7)) for name, kind in self.vertex]
            if self.list_at is not None:
                parts.insert(self.list_at, self._list("ushort", "short", weights))
            records.append(self._join(parts))
        records += [self._list("uchar", "int", [0, 1, 2])] * self.after
        end = self.newline.encode() if self.format == "ascii" else b""
        return b"".join(record + end for record in records)

    def _join(self, parts: list[bytes]) -> bytes:
        return (b" " if self.format == "ascii" else b"").join(parts)

    def _item(self, kind: str, value: float) -> bytes:
        if self.format == "ascii":
            return repr(float(value)).encode()
        order = "<" if "little" in self.format else ">"
        return np.array(value).astype(order + CODES[kind]).tobytes()

    def _list(self, count: str, kind: str, values: list[int]) -> bytes:
        if self.format == "ascii":
            return " ".join(map(str, [len(values), *values])).encode()
        parts = [self._item(count, len(values)), *(self._item(kind, v) for v in values)]
        return b"".join(parts)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    return Layout(draw)


@quick
@given(layouts())
def test_every_layout_reads_back(tmp_path: Path, layout: Layout) -> None:
    path = ply(tmp_path / "a.ply", layout.header(), layout.body(), layout.newline)
    # Where a layout has faces these are any, and no mesh to put points on.
    np.testing.assert_array_equal(read_ply(path).points, layout.points)


@quick
@given(layouts(), st.data())
def test_cut_anywhere_it_is_an_error_or_whole(
    tmp_path: Path, layout: Layout, data: st.DataObject
) -> None:
    whole = ply(tmp_path / "a.ply", layout.header(), layout.body(), layout.newline).read_bytes()
    cut = data.draw(st.integers(0, len(whole)))
    path = tmp_path / "cut.ply"
    path.write_bytes(whole[:cut])
    try:
        points = read_ply(path).points
    except InputError as error:
        assert str(path) in str(error)
        return
    # Only what comes after the vertices may be missing; or, at the very end of an ASCII file
    # that has nothing else, the tail of the last number: no reader can know.
    assert len(points) == len(layout.points)
    if layout.after or layout.format != "ascii":
        np.testing.assert_array_equal(points, layout.points)


@quick
@given(layouts(), st.data())
def test_damaged_bytes_are_an_error_or_points(
    tmp_path: Path, layout: Layout, data: st.DataObject
) -> None:
    content = bytearray(
        ply(tmp_path / "a.ply", layout.header(), layout.body(), layout.newline).read_bytes()
    )
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.integers(0, 255))
    path = tmp_path / "bad.ply"
    path.write_bytes(content)
    try:
        points = read_points(path)
    except InputError:
        return
    assert len(points) > 0
    assert np.isfinite(points).all()


@pytest.mark.parametrize("with_normals", [False, True])
def test_written_files_read_back_bit_for_bit(
    tmp_path: Path, rng: np.random.Generator, with_normals: bool
) -> None:
    points = rng.normal(size=(50, 3)) * 1e7
    write_ply(tmp_path / "new" / "a.ply", points, points if with_normals else None)
    np.testing.assert_array_equal(read_points(tmp_path / "new" / "a.ply"), points)
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["a.ply"]


def test_open3d_reads_what_is_written(tmp_path: Path, rng: np.random.Generator) -> None:
    from mvreg._open3d import load_open3d

    points, normals = rng.normal(size=(2, 50, 3))
    write_ply(tmp_path / "a.ply", points, normals)
    cloud = load_open3d().io.read_point_cloud(str(tmp_path / "a.ply"))
    np.testing.assert_array_equal(np.asarray(cloud.points), points)
    np.testing.assert_allclose(np.asarray(cloud.normals), normals, rtol=1e-6)


def test_a_failed_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.ply"
    write_ply(path, np.zeros((1, 3)))
    before = path.read_bytes()

    def full(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(InputError, match="No space left"):
        write_ply(path, np.ones((1, 3)))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.ply"]


@pytest.mark.parametrize(
    ("points", "normals"),
    [(np.zeros((3, 2)), None), (np.zeros(3), None), (np.zeros((3, 3)), np.zeros((2, 3)))],
)
def test_wrong_shapes_are_not_written(
    tmp_path: Path, points: np.ndarray, normals: np.ndarray | None
) -> None:
    with pytest.raises(InputError, match="expected"):
        write_ply(tmp_path / "a.ply", points, normals)
    assert not list(tmp_path.iterdir())


def test_not_a_number_is_dropped(tmp_path: Path) -> None:
    body = "1 2 3\nnan 2 3\n4 inf 6\n-1.#IND 0 0\n-nan(ind) 0 0\n7 8 9\n"
    points = read_points(ascii_ply(tmp_path / "a.PLY", body, 6))
    np.testing.assert_array_equal(points, [[1, 2, 3], [7, 8, 9]])


def test_blank_lines_between_vertices_do_not_count(tmp_path: Path) -> None:
    body = "\n1 2 3\n\n4 5 6\n  \n7 8 9\n\n"
    np.testing.assert_array_equal(
        read_points(ascii_ply(tmp_path / "a.ply", body)), [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    )


FACES = "element face 1\nproperty list uchar int vertex_indices\n"


@pytest.mark.parametrize(
    ("body", "count", "rest", "message"),
    [
        ("1 2 3\n4 5 six\n7 8 9\n", 3, "", "line 9: expected a number, got 'six'"),
        ("1 2 3\n4 5\n7 8 9\n", 3, "", "line 9: expected 3 numbers, got 2"),
        ("1 2 3\n4 5 6 6\n7 8\n", 3, "", "line 9: expected 3 numbers, got 4"),
        ("1 2 3\n4 5 6\n", 3, "", "2 of 3 vertices"),
        ("1 2 3\n4 5 6\n7 8 9.1", 3, FACES, "2 of 3 vertices"),
        ("1 2 3\n4 5 6\n7 8 9\n1 1 1\n", 3, "", "line 11: expected the end of the file"),
        ("1 2 3\n4 5 6\n7 8 9\n3 0 1 2\n", 4, FACES, "line 13: expected 3 numbers, got 4"),
        ("nan nan nan\n" * 3, 3, "", "only NaN or infinite"),
        ("", 0, "", "announces no vertices"),
        ("1 2 3\n", 10**17, "", "announces 100000000000000000 vertices"),
        ("1,0 2,0 3,0\n" * 3, 3, "", "line 8: expected a number, got '1,0'"),
    ],
)
def test_ascii_damage_is_named(
    tmp_path: Path, body: str, count: int, rest: str, message: str
) -> None:
    path = ascii_ply(tmp_path / "a.ply", body, count, rest)
    with pytest.raises(InputError, match=message) as caught:
        read_points(path)
    assert str(path) in str(caught.value)


XYZ = "property float x\nproperty float y\nproperty float z\n"
BINARY = "format binary_little_endian 1.0\n"


@pytest.mark.parametrize(
    ("header", "body", "message"),
    [
        ("element vertex 1\n" + XYZ, b"", "expected a line 'format'"),
        ("format ascii\nelement vertex 1\nproperty float x", b"1\n", "vertices with x, y and z"),
        ("format ascii\nelement face 1\n" + XYZ, b"1 2 3\n", "expected an element 'vertex'"),
        ("format binary 1.0\nelement vertex 1\n" + XYZ, b"", "line 2: expected format"),
        ("format ascii 1.0\nelement vertex\n" + XYZ, b"", "line 3: expected 'element NAME COUNT'"),
        ("format ascii 1.0\nelement vertex -1\n" + XYZ, b"", "line 3: expected 'element NAME"),
        ("format ascii 1.0\nelement vertex 1\nproperty float", b"", "line 4: expected 'property"),
        ("format ascii 1.0\n" + XYZ, b"", "line 3: a property before"),
        (BINARY + "element vertex 2\n" + XYZ, b"\0" * 23, "byte 138: the file ends after 1 of 2"),
        (BINARY + "element vertex 2\n" + XYZ, b"\0" * 36, "count is wrong"),
        (BINARY + "element vertex 1\nproperty half q\n" + XYZ, b"\0" * 20, "got 'half'"),
        (BINARY + "element f 1\nproperty list char int i\nelement vertex 1\n" + XYZ,
         b"\xff" * 20, "length of a list in f 0, got -1"),
        (BINARY + "element f 2\nproperty list int int i\nelement vertex 1\n" + XYZ,
         b"\x30\0\0\0" * 9, "ends after 0 of 2 records of f"),
        (BINARY + "element f 999999999999999999\nproperty int i\nelement vertex 1\n" + XYZ,
         b"\0" * 20, "ends after 0 of 1 records of vertex"),
        (BINARY + "element vertex 1\nproperty list float int i\n" + XYZ,
         b"\0\0\xc0\x7f" * 5, "length of a list in vertex 0, got nan"),
        ("format ascii 1.0\nelement f 5\nproperty int i\nelement vertex 1\n" + XYZ,
         b"1\n1\n1\n", "ends before the vertices begin"),
        ("format ascii 1.0\nelement vertex 1\nproperty list char int i\n" + XYZ,
         b"5 1 2 3\n", "line 9: expected the properties"),
    ],
)  # fmt: skip
def test_header_and_binary_damage_is_named(
    tmp_path: Path, header: str, body: bytes, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_points(ply(tmp_path / "a.ply", header, body))


@pytest.mark.parametrize("content", [b"", b"\0", b"\0" * 5000, b"pl", b"ply", b"solid x\n"])
def test_what_is_no_ply_says_so(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(content)
    with pytest.raises(InputError, match="line 1: expected 'ply'"):
        read_points(path)


def test_a_header_without_end_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 3\n")
    with pytest.raises(InputError, match="ends before 'end_header'"):
        read_points(path)


def test_binary_data_may_begin_like_a_line_end(tmp_path: Path) -> None:
    header = BINARY + "element vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z"
    points = read_points(ply(tmp_path / "a.ply", header, b"\n\r\n"))
    np.testing.assert_array_equal(points, [[10, 13, 10]])
