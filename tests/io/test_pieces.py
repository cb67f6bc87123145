"""Read piece by piece, a file is what it is read whole; what is odd is left to the whole."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from writer_variants import ALL, POINTS, Variant

from experiments.fuzz.files import damaged, good_files
from mvreg.errors import InputError
from mvreg.io import NotInPiecesError, Pieces, open_pieces, read_cloud
from mvreg.io.columns import attributes_of, telling_rows

#: Less than the files here, and more than the rows that tell how a text is laid out.
BYTES, ROWS = 12_000, 64
#: Formats of files that hold points alone, when they are as they should be.
IN_PIECES = ("ply", "pcd", "xyz", "xyzn", "xyzrgb", "txt", "csv", "asc")


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mvreg.io.pieces.BYTES", BYTES)
    monkeypatch.setattr("mvreg.io.pieces.ROWS", ROWS)
    monkeypatch.setattr("mvreg.io.points.with_points_on_triangles", lambda cloud: cloud)


def only(path: Path) -> Pieces:
    """The only scan of a file."""
    return next(open_pieces(path))


def check(path: Path) -> int:
    """Compare the pieces of a file with the whole; how many there are."""
    whole, pieces = read_cloud(path), only(path)
    parts = [cloud.points for cloud in pieces.clouds]
    points = np.concatenate(parts)
    clouds = [*pieces.again()]
    np.testing.assert_array_equal(np.concatenate([c.points for c in clouds]), points)
    finite = np.isfinite(points).all(axis=1)
    np.testing.assert_array_equal(points[finite], whole.points)
    assert pieces.kinds == {name: values.dtype for name, values in whole.attributes.items()}
    assert list(pieces.kinds) == list(whole.attributes)
    for name, values in whole.attributes.items():
        again = np.concatenate([cloud.attributes[name] for cloud in clouds])
        np.testing.assert_array_equal(again[finite], values)
    assert tuple(pieces.remarks) == whole.remarks
    assert 0.9 <= pieces.count / len(points) <= 2.1  # as many as twice in UTF-16
    assert all(part.dtype == np.float64 and part.shape[1] == 3 for part in parts)
    return len(parts)


PLAIN = [
    v for v in ALL
    if v.suffix in IN_PIECES and not v.refused and "m" not in v.has and "compressed" not in v.what
]  # fmt: skip


@pytest.mark.parametrize("variant", PLAIN, ids=lambda v: f"{v.writer}, {v.what}")
def test_pieces_are_the_whole(variant: Variant, tmp_path: Path) -> None:
    path = tmp_path / f"a.{variant.suffix}"
    variant.write(path)
    several = path.stat().st_size > BYTES or "text" not in variant.what
    assert (check(path) > 1) >= several * (variant.suffix in ("ply", "pcd"))


def test_most_variants_are_looked_at() -> None:
    assert len(PLAIN) >= 30


def rows(more: Callable[[int], str]) -> str:
    lines = (f"{x} {y} {z}{more(i)}" for i, (x, y, z) in enumerate(POINTS.tolist() * 3))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "more",
    [
        lambda i: f" {i % 256} {i % 7} {i % 99}",  # colours
        lambda i: f" {i % 256 if i else 0.5} {i % 7} {i % 99}",  # but one
        lambda i: f" {i % 256 if i < 899 else 256} 0 0",  # but the last
        lambda i: " 0 0 1" if i % 2 else " 0 0 0",  # normals
        lambda i: " 0 0 1" if i != 700 else " 0 0 1.2",  # but one
        lambda i: f" {'nan' if i == 450 else i % 256} 1 2",
        lambda i: f" {i} {i % 256} {i % 7} {i % 99}",  # brightness and colours
        lambda i: f" {i % 256} {i % 7} {i % 99} 255",  # colours and alpha
        lambda i: f" {i % 256} {i % 7} {i % 99} {255 if i != 800 else 254}",
        lambda i: "" if i != 444 else "\n\n# a remark",
        lambda i: " nan",
        lambda i: f" {i % 300}",
    ],
)
def test_what_one_row_changes_is_noticed(tmp_path: Path, more: Callable[[int], str]) -> None:
    (tmp_path / "a.xyz").write_text(rows(more))
    assert check(tmp_path / "a.xyz") > 1
    (tmp_path / "a.xyz").write_text(rows(more).replace("\n", "\r\n") + "\0\x1a")
    check(tmp_path / "a.xyz")


@pytest.mark.parametrize("heading", ["red green blue", "r g b", "nx ny nz", "a b c"])
def test_columns_with_names(tmp_path: Path, heading: str) -> None:
    text = rows(lambda i: f" {i / 900} {i % 7 / 7} {i % 99 / 99}")
    (tmp_path / "a.txt").write_text(f"x y z {heading}\n{text}")
    assert check(tmp_path / "a.txt") > 1


def test_rows_that_tell_are_few() -> None:
    table = np.random.default_rng(0).normal(size=(5000, 7))
    found = telling_rows(table)
    assert len(found) <= 5 * 7
    whole = attributes_of(table, (0, 1, 2), None, frozenset())
    assert whole.keys() == attributes_of(found, (0, 1, 2), None, frozenset()).keys()
    assert telling_rows(table[:0]).shape == (0, 7)


PLY = "ply\nformat ascii 1.0\nelement vertex {}\n" + "".join(f"property float {a}\n" for a in "xyz")
PCD = (
    "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\n"
    "POINTS {0}\nDATA {1}\n"
)
BODY = rows(lambda i: "")
BINARY = POINTS.astype("<f4").tobytes()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.ply", PLY.format(901) + "end_header\n" + BODY, "after 900 of 901"),
        ("a.ply", PLY.format(899) + "end_header\n" + BODY, "count is wrong"),
        ("a.ply", PLY.format(900) + "end_header\n" + BODY.replace("\n", " 1\n"), "3 numbers"),
        ("a.pcd", PCD.format(901, "ascii") + BODY, "truncated"),
        ("a.pcd", PCD.format(899, "ascii") + BODY, "count is wrong"),
        ("a.pcd", PCD.format(900, "ascii") + BODY.replace("1 ", "x ", 1), "number"),
        ("a.xyz", BODY + "1 2\n", "line 901: expected 3 numbers"),
        ("a.xyz", BODY + "1 2\n" + BODY, "expected 3 numbers"),
    ],
)
def test_damage_is_told_by_the_whole(tmp_path: Path, name: str, content: str, message: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises((NotInPiecesError, InputError)):
        pieces = only(tmp_path / name)
        for _ in pieces.clouds:
            pass
    with pytest.raises(InputError, match=message):
        read_cloud(tmp_path / name)


@pytest.mark.parametrize("more", [-5, 12, 500])
def test_bytes_too_few_or_too_many(tmp_path: Path, more: int) -> None:
    head = PLY.format(300).replace("ascii", "binary_little_endian") + "end_header\n"
    body = (BINARY + bytes(500))[: len(BINARY) + more]
    for name, start in (("a.ply", head), ("a.pcd", PCD.format(300, "binary"))):
        (tmp_path / name).write_bytes(start.encode() + body)
        pieces = only(tmp_path / name)
        with pytest.raises(NotInPiecesError):
            next(pieces.clouds)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.ply", PLY.format(3) + "element face 1\nproperty list uchar int vertex_indices\n"
         "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
        ("a.ply", "no"), ("a.pcd", "no"), ("a.xyz", "no"),
        ("a.pcd", PCD.format(1, "binary_compressed")), ("a.obj", "v 1 2 3\n"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_in_pieces(tmp_path: Path, name: str, content: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(NotInPiecesError):
        only(tmp_path / name)


def test_poses_are_no_points_in_pieces_either(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("1 1 2 3 0 0 0 1\n" * 1000)
    pieces = only(tmp_path / "a.txt")
    with pytest.raises(NotInPiecesError):
        list(pieces.clouds)
    with pytest.raises(InputError, match="poses with quaternions"):
        read_cloud(tmp_path / "a.txt")


@pytest.mark.parametrize(
    "name", ["ascii.ply", "little.ply", "big.ply", "ascii.pcd", "binary.pcd", "a.xyz", "a.csv"]
)
def test_damaged_files_come_in_pieces_only_if_the_whole_is_the_same(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mvreg.io.pieces.ROWS", 16)
    monkeypatch.setattr("mvreg.io.points.with_points_on_triangles", lambda cloud: cloud)
    rng, path, compared = np.random.default_rng(len(name)), tmp_path / name, 0
    good = good_files(tmp_path)[name]
    if name.endswith("ply"):  # without its faces
        good = good.replace(b"element face 20", b"element face 0")
        good = good[: good.index(b"end_header\n") + 11 + (480 if name != "ascii.ply" else 10**6)]
        good = good if name != "ascii.ply" else b"\n".join(good.split(b"\n")[:-21]) + b"\n"
    for _ in range(400):
        path.write_bytes(damaged(good, rng))
        try:
            pieces = only(path)
            parts = [np.empty((0, 3)), *(cloud.points for cloud in pieces.clouds)]
        except (NotInPiecesError, InputError):
            continue
        points = np.concatenate(parts)
        finite = np.isfinite(points).all(axis=1)
        if not finite.any():
            continue
        whole = read_cloud(path)
        np.testing.assert_array_equal(points[finite], whole.points)
        assert pieces.kinds == {key: values.dtype for key, values in whole.attributes.items()}
        compared += 1
    assert compared > 15
