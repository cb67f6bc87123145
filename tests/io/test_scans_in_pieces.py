"""LAS, E57, PTX, PTS and what is compressed: every scan in pieces is what it is read whole."""

from __future__ import annotations

import gc
import gzip
import zipfile
from collections.abc import Callable
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from writer_variants import ALL, POINTS, Variant, need

from experiments.fuzz.files import damaged, good_files
from mvreg.errors import InputError
from mvreg.io import NotInPiecesError, PointCloud, open_pieces, read_clouds, whole_scan
from mvreg.io.e57 import _ONE
from mvreg.io.e57_write import write_e57_scans
from mvreg.io.las_write import write_las_clouds

RNG = np.random.default_rng(4)
GREY = RNG.integers(0, 256, len(POINTS)).astype("u1")


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mvreg.io.pieces.BYTES", 3000)
    monkeypatch.setattr("mvreg.io.las.CHUNK", 64)
    monkeypatch.setattr("mvreg.io.e57.CHUNK", 64)
    monkeypatch.setattr("mvreg.io.compressed_pieces.WORTH", 0)
    monkeypatch.setattr("mvreg.io.points.with_points_on_triangles", lambda cloud: cloud)


def same(one: PointCloud, other: PointCloud) -> None:
    np.testing.assert_array_equal(one.points, other.points)
    assert list(one.attributes) == list(other.attributes)
    for name, values in one.attributes.items():
        assert values.dtype == other.attributes[name].dtype, name
        np.testing.assert_array_equal(values, other.attributes[name])
    for key in ("view_point", "T_world_scan"):
        np.testing.assert_array_equal(getattr(one, key), getattr(other, key))
    assert (one.levelled, one.remarks) == (other.levelled, other.remarks)


def check(path: Path) -> int:
    """Compare every scan of a file, taken whole, in pieces, and in pieces once more; the pieces."""
    expected, number = read_clouds(path), 0
    kept = []
    for pieces in open_pieces(path):
        parts = [cloud.points for cloud in pieces.clouds]
        number += len(parts)
        kept.append((pieces, parts))
    assert len(kept) == len(expected)
    for (pieces, parts), one in zip(kept, expected, strict=True):
        same(whole_scan(pieces, begun=True), one)
        points = np.concatenate(parts)
        np.testing.assert_array_equal(points[np.isfinite(points).all(axis=1)], one.points)
        assert pieces.kinds == {name: values.dtype for name, values in one.attributes.items()}
        assert len(kept) == 1 or pieces.name == one.name
        assert len([*pieces.again()]) == len(parts)
    for pieces, one in zip(open_pieces(path), expected, strict=True):
        same(whole_scan(pieces), one)
    return number


SUFFIXES = ("las", "laz", "e57", "ptx", "pts", "gz", "zip")
VARIANTS = [v for v in ALL if v.suffix.split(".")[-1] in SUFFIXES and not v.refused]


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda v: f"{v.writer}, {v.what}")
def test_what_others_write(variant: Variant, tmp_path: Path) -> None:
    path = tmp_path / f"a.{variant.suffix}"
    variant.write(path)
    assert check(path) >= 1
    if variant.suffix in ("las", "laz", "e57"):
        assert check(path) == -(-len(POINTS) // 64)


def test_that_variants_are_there() -> None:
    assert {v.suffix.split(".")[-1] for v in VARIANTS} >= {"las", "laz", "e57", "pts", "gz", "zip"}


def test_withheld_points(tmp_path: Path) -> None:
    laspy = need("laspy")
    data = laspy.LasData(laspy.LasHeader(point_format=7, version="1.4"))
    data.x, data.y, data.z = POINTS.T
    data.withheld = np.arange(len(POINTS)) % 7 == 0
    data.red = np.where(np.arange(len(POINTS)) == 299, 1, 0)  # the last alone tells of colours
    data.write(tmp_path / "a.laz")
    assert check(tmp_path / "a.laz") == 5
    (found,) = read_clouds(tmp_path / "a.laz")
    assert found.remarks == ("43 withheld points left out",)
    assert set(found.attributes) == {"red", "green", "blue"}
    data.withheld = np.ones(len(POINTS), bool)
    data.write(tmp_path / "b.las")
    with pytest.raises(InputError, match="all 300 points are withheld"):
        read_clouds(tmp_path / "b.las")


def test_layers_larger_than_their_chunk(tmp_path: Path) -> None:
    """Refused before lazrs asks for as much memory."""
    content = bytearray(good_files(tmp_path)["new.laz"])
    start = int.from_bytes(content[96:100], "little")
    length = int.from_bytes(content[105:107], "little")
    first = start + 8 + length + 4
    content[first + 3] = 16  # of the first layer, 256 MB
    (tmp_path / "a.laz").write_bytes(content)
    with pytest.raises(InputError, match=r"chunk 1 tells of layers of 2684\d+ bytes"):
        read_clouds(tmp_path / "a.laz")


@pytest.mark.parametrize("kind", [0, 1, 2, 3, 6, 7, 8])
def test_layers_of_every_point_format(tmp_path: Path, kind: int) -> None:
    laspy = need("laspy")
    header = laspy.LasHeader(point_format=kind, version="1.4" if kind > 5 else "1.3")
    header.add_extra_dim(laspy.ExtraBytesParams("amplitude", "3f4"))
    data = laspy.LasData(header)
    data.x, data.y, data.z = np.tile(POINTS, (200, 1)).T  # more than a chunk
    data.write(tmp_path / "a.laz")
    assert len(read_clouds(tmp_path / "a.laz")[0].points) == 200 * len(POINTS)


def e57(path: Path, scans: dict[str, dict[str, object]]) -> None:
    pye57 = need("pye57")
    with pye57.E57(str(path), "w") as file:
        for name, more in scans.items():
            columns = {f"cartesian{axis}": POINTS[:, i].copy() for i, axis in enumerate("XYZ")}
            file.write_scan_raw({**columns, **more}, name=name)


def test_e57_of_several_scans(tmp_path: Path) -> None:
    state = np.zeros(len(POINTS), "i1")
    state[:100] = 2
    colours = {f"color{c}": GREY.copy() for c in ("Red", "Green", "Blue")}
    grid = {"rowIndex": np.arange(300, dtype="i4"), "columnIndex": np.zeros(300, "i4")}
    e57(tmp_path / "a.e57", {
        "first": {"cartesianInvalidState": state, **colours}, "second": grid,
        "third": {"intensity": np.arange(300) / 300},
    })  # fmt: skip
    assert check(tmp_path / "a.e57") == 15
    first, second, _ = read_clouds(tmp_path / "a.e57")
    assert first.remarks == ("100 of 300 points without a return left out",)
    assert first.view_point is None and second.view_point is not None


def test_e57_with_scans_without_points(tmp_path: Path) -> None:
    need("pye57")
    empty, full = PointCloud(np.empty((0, 3)), name="none"), PointCloud(POINTS, name="all")
    write_e57_scans(tmp_path / "a.e57", [[empty], [full], [empty], [full]])
    assert check(tmp_path / "a.e57") == 10
    assert read_clouds(tmp_path / "a.e57")[0].remarks == ("scans without points left out: none",)


def test_that_a_scan_left_half_read_may_be_collected_at_any_time(tmp_path: Path) -> None:
    e57(tmp_path / "a.e57", {"one": {}})
    opened = open_pieces(tmp_path / "a.e57")
    next(next(opened).clouds)
    del opened

    def collect() -> None:
        with _ONE:
            gc.collect()

    thread = Thread(target=collect, daemon=True)
    thread.start()
    thread.join(30)
    assert not thread.is_alive()


HEADER = "{}\n{}\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n"


def ptx(more: Callable[[int], str], missing: int = 0) -> str:
    lines = [f"{x} {y} {z}" for x, y, z in POINTS.tolist()]
    lines[5 : 5 + missing] = ["0 0 0"] * missing
    return HEADER.format(30, 10) + "".join(f"{a}{more(i)}\n" for i, a in enumerate(lines))


def pts(more: Callable[[int], str]) -> str:
    return "300\n" + ptx(more)[len(HEADER.format(30, 10)) :]


ROWS = [
    lambda i: "",
    lambda i: " 0.25",
    lambda i: f" 0.25 {i % 256} {i % 7} {i % 99}",
    lambda i: f" 0.25 {i % 256 if i < 299 else 256} 0 0",
    lambda i: f" 0.25 {i % 256 if i < 299 else 0.5} 0 0",
    lambda i: f" 0.25 {i % 256 if i < 299 else -1} 0 0",
    lambda i: f" {i % 256} {i % 7} {i % 99}",
]


@pytest.mark.parametrize("more", ROWS)
@pytest.mark.parametrize("scans", [1, 3])
def test_ptx_and_pts(tmp_path: Path, more: Callable[[int], str], scans: int) -> None:
    for suffix, text in (("ptx", ptx(more, 20)), ("pts", pts(more))):
        for name, content in (
            ("plain", text * scans),
            ("returns", (text * scans).replace("\n", "\r\n")),
            ("marked", "\ufeff" + text * scans + "\n \0\x1a"),
        ):
            path = tmp_path / f"{name}.{suffix}"
            path.write_bytes(content.encode())
            assert check(path) > scans
            (tmp_path / f"{name}.{suffix}.gz").write_bytes(gzip.compress(path.read_bytes()))
            assert check(tmp_path / f"{name}.{suffix}.gz") > scans


@pytest.mark.parametrize(
    "content",
    [
        ptx(ROWS[1]).replace("\n", "\r"), ptx(ROWS[1])[:-30], ptx(ROWS[1]) + "1 2 3\n",
        ptx(ROWS[1]).replace(" 0.25", " x", 1), HEADER.format(0, 0) + ptx(ROWS[1]),
        ptx(ROWS[1], 295).replace("-", "") + HEADER.format(1, 1) + "0 0 0 0\n",
        ptx(ROWS[1]).replace("1 0 0 0\n", "1 0 0\n"),
    ],
)  # fmt: skip
def test_what_is_odd_is_read_whole(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.ptx").write_bytes(content.encode())
    with pytest.raises((NotInPiecesError, InputError)):
        for pieces in open_pieces(tmp_path / "a.ptx"):
            whole_scan(pieces)


def test_archives(tmp_path: Path) -> None:
    write_las_clouds(tmp_path / "a.laz", [PointCloud(POINTS)], {})
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("one/a.ptx", ptx(ROWS[2]) * 2)
        archive.writestr("b.ptx", ptx(ROWS[1]))
        archive.writestr("c.xyz", pts(ROWS[2])[4:])
        archive.writestr("notes.pdf", "%")
        archive.write(tmp_path / "a.laz", "d.laz")
    assert check(tmp_path / "a.zip") > 12
    (tmp_path / "a.laz.gz").write_bytes(gzip.compress((tmp_path / "a.laz").read_bytes()))
    assert check(tmp_path / "a.laz.gz") == 5
    (tmp_path / "b.laz.gz").write_bytes(gzip.compress((tmp_path / "a.laz").read_bytes())[:-20])
    with pytest.raises(InputError, match="cannot be unpacked"):
        check(tmp_path / "b.laz.gz")


@pytest.mark.parametrize("suffix", ["gz", "zip"])
def test_that_nothing_unpacked_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "unpacked"))
    (tmp_path / "unpacked").mkdir()
    path = tmp_path / f"a.ptx.{suffix}"
    path.write_bytes(gzip.compress(ptx(ROWS[1]).encode()))
    if suffix == "zip":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("a.ptx", ptx(ROWS[1]))

    def left() -> int:
        return len([*(tmp_path / "unpacked").iterdir()])

    opened = open_pieces(path)
    pieces = next(opened)
    next(pieces.clouds)
    assert left() == 1
    opened.close()
    assert left() == 0
    for pieces in open_pieces(path):
        assert len([*pieces.clouds]) > 1
    again = pieces.again()
    next(again)
    assert left() == 1
    del again
    assert left() == 0
    with pytest.raises(KeyError):
        for _ in open_pieces(path):
            raise KeyError
    assert left() == 0


def test_that_small_archives_are_read_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    (tmp_path / "a.xyz.gz").write_bytes(gzip.compress(pts(ROWS[1])[4:].encode()))
    with pytest.raises(NotInPiecesError):
        next(open_pieces(tmp_path / "a.xyz.gz"))


DAMAGED = (
    "old.las", "new.las", "old.laz", "new.laz", "a.e57", "a.ptx", "a.pts", "a.ptx.gz", "a.zip"
)  # fmt: skip


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_files_come_in_pieces_only_if_the_whole_is_the_same(
    tmp_path: Path, name: str
) -> None:
    good, rng = good_files(tmp_path).get(name), np.random.default_rng(len(name))
    if good is None:
        pytest.skip(f"NOT TESTED: {name} needs an extra")
    path, compared = tmp_path / name, 0
    for number in range(150):
        path.write_bytes(damaged(good, rng) if number else good)
        try:
            found = [whole_scan(pieces) for pieces in open_pieces(path)]
        except (NotInPiecesError, InputError, OSError, MemoryError):
            continue
        if not found:
            continue
        for one, whole in zip(found, read_clouds(path), strict=True):
            same(one, whole)
        compared += 1
    assert compared >= 1
