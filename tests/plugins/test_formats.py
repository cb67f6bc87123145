"""File formats that plugins bring."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mvreg.errors import PluginError
from mvreg.io import Format, PointCloud, read_clouds
from mvreg.io.formats import FORMATS, single
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
    assert collect_formats(manager(other=lambda: [other]))[".ply"] is other


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (lambda: 1 / 0, r"'odd' \(dist-odd 1.0\) failed in mvreg_formats\(\): ZeroDivisionError"),
        (lambda: ["PTX"], "'odd' .*mvreg.io.Format, got str"),
        (lambda: [Format("odd", ("ptx",), FORMAT.read)], r"'odd' .*such as '.ptx'; got \['ptx'\]"),
        (lambda: [Format("odd", (), FORMAT.read)], "'odd' .*got none"),
    ],
)
def test_that_what_is_no_format_is_refused_by_name(given, said):
    with pytest.raises(PluginError, match=said):
        collect_formats(manager(odd=given))


def test_that_two_plugins_with_one_suffix_are_named():
    with pytest.raises(PluginError, match=r"'.ours' is registered twice: .*'a'.*'b'|'b'.*'a'"):
        collect_formats(manager(a=lambda: [FORMAT], b=lambda: [FORMAT]))
