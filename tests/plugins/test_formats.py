"""File formats that plugins bring."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mvreg.errors import InputError, PluginError
from mvreg.io import Format, PointCloud, read_clouds
from mvreg.io.formats import FORMATS, ReadOptions, single
from mvreg.io.pieces import NotInPiecesError, Pieces
from mvreg.plugins.formats import collect_formats
from mvreg.plugins.pluggy_manager import Manager

FORMAT = Format("ours", (".ours",), single(lambda path: PointCloud(np.ones((2, 3)))))


def manager(**hooks):
    found = Manager()
    for name, given in hooks.items():
        found.add(SimpleNamespace(mvreg_formats=given), name, f"dist-{name} 1.0")
    return found


def test_that_a_plugins_format_is_read_beside_ours(tmp_path):
    formats = collect_formats(manager(ours=lambda: [FORMAT]))
    assert set(formats) == {".ours"} | {s for each in FORMATS for s in each.suffixes}
    (tmp_path / "a.ours").touch()
    (cloud,) = read_clouds(tmp_path / "a.ours", formats=formats)
    np.testing.assert_array_equal(cloud.points, np.ones((2, 3)))


def test_that_a_plugins_format_replaces_ours():
    other = Format("other", (".ply",), FORMAT.read)
    assert collect_formats(manager(other=lambda: [other]))[".ply"].name == "other"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (lambda: 1 / 0, r"'odd' \(dist-odd 1.0\) failed in mvreg_formats\(\): ZeroDivisionError"),
        (lambda: ["PTX"], "'odd' .*mvreg.io.Format, got str"),
        (lambda: [Format("odd", ("ptx",), FORMAT.read)], r"'odd' .*such as '.ptx'; got \['ptx'\]"),
        (lambda: [Format("odd", (), FORMAT.read)], "'odd' .*got none"),
        (
            lambda: [Format("odd", (".odd",), lambda path: [])],
            r"expected read\(path, options\), got",
        ),
        (
            lambda: [Format("odd", (".odd",), FORMAT.read, lambda path: [])],
            r"expected pieces\(path, options\), got",
        ),
        (lambda: [Format("odd", (".odd",), None)], "got None; change its parameters"),
    ],
)
def test_that_what_is_no_format_is_refused_by_name(given, said):
    with pytest.raises(PluginError, match=said):
        collect_formats(manager(odd=given))


def test_that_two_plugins_with_one_suffix_are_named():
    with pytest.raises(PluginError, match=r"'.ours' is registered twice: .*'a'.*'b'|'b'.*'a'"):
        collect_formats(manager(a=lambda: [FORMAT], b=lambda: [FORMAT]))


CLOUD = PointCloud(np.ones((2, 3)))


@pytest.mark.parametrize(
    ("read", "said"),
    [
        (lambda *_: CLOUD, "got one PointCloud; return it in a tuple$"),
        (lambda *_: np.ones((2, 3)), r"got an array \(2, 3\) of float64$"),
        (lambda *_: None, "got TypeError: 'NoneType' object is not iterable"),
        (lambda *_: [1 / 0], r"got ZeroDivisionError: division by zero at .*test_formats.py:\d+$"),
        (lambda *_: (CLOUD if n == 0 else n // 0 for n in range(2)), "got ZeroDivisionError"),
    ],
)
def test_that_a_failing_reader_names_its_plugin_and_the_file(read, said, tmp_path):
    formats = collect_formats(manager(odd=lambda: [Format("Odd", (".odd",), read)]))
    (tmp_path / "a.odd").touch()
    head = (
        r"a.odd: format 'Odd' \(plugin 'odd' \(dist-odd 1.0\)\): expected read\(path, options\) -"
    )
    with pytest.raises(PluginError, match=f"{head}.*{said}"):
        read_clouds(tmp_path / "a.odd", formats=formats)


def in_pieces(path, read):
    return [Pieces(read, path, 2)]


@pytest.mark.parametrize(
    ("pieces", "said"),
    [
        (lambda path, _: Pieces(lambda _: iter([CLOUD]), path, 2), "got one Pieces; return it in"),
        (lambda *_: [CLOUD], "expected pieces.*mvreg.io.pieces.Pieces, or .*got a list"),
        (lambda *_: 1 / 0, "expected pieces.*got ZeroDivisionError: division by zero at"),
        (lambda path, _: in_pieces(path, lambda _: iter([1 / 0])), r"Pieces.read\(path\) .*Zero"),
        (lambda path, _: in_pieces(path, lambda _: iter([np.ones(3)])), "Pieces.read.*PointCloud"),
    ],
)
def test_that_a_failing_reader_in_pieces_names_its_plugin_and_the_file(pieces, said, tmp_path):
    form = Format("Odd", (".odd",), FORMAT.read, pieces)
    found = collect_formats(manager(odd=lambda: [form]))[".odd"]
    with pytest.raises(PluginError, match=f"a.odd: format 'Odd' .plugin 'odd'.*{said}"):
        [each.whole() for each in found.pieces(tmp_path / "a.odd", ReadOptions())]


def test_that_a_reader_may_say_that_a_file_is_to_be_read_whole(tmp_path):
    def no(path, options):
        raise NotInPiecesError

    (tmp_path / "a.odd").touch()
    form = Format("Odd", (".odd",), FORMAT.read, no)
    formats = collect_formats(manager(odd=lambda: [form]))
    with pytest.raises(NotInPiecesError):
        list(formats[".odd"].pieces(tmp_path / "a.odd", ReadOptions()))
    right = Format(
        "Odd", (".odd",), FORMAT.read, lambda p, _: in_pieces(p, lambda _: iter([CLOUD]))
    )
    formats = collect_formats(manager(odd=lambda: [right]))
    (found,) = formats[".odd"].pieces(tmp_path / "a.odd", ReadOptions())
    np.testing.assert_array_equal(found.whole().points, CLOUD.points)


def test_that_a_damaged_file_is_told_as_the_reader_says(tmp_path):
    def read(path, options):
        raise InputError(f"{path}: damaged")

    formats = collect_formats(manager(odd=lambda: [Format("Odd", (".odd",), read)]))
    (tmp_path / "a.odd").touch()
    with pytest.raises(InputError, match=r"a\.odd: damaged$"):
        read_clouds(tmp_path / "a.odd", formats=formats)
