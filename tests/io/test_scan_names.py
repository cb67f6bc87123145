"""Which scans a file means by the names that it gives."""

from __future__ import annotations

from pathlib import Path

import pytest

from mvreg.errors import InputError
from mvreg.io.scan_names import matched, meant, unused


@pytest.mark.parametrize(
    ("given", "names", "pairs"),
    [
        (["a.ply", "b.ply"], ["a.ply", "b.ply"], {"a.ply": "a.ply", "b.ply": "b.ply"}),
        (["a", "c"], ["a.ply", "b.ply"], {"a": "a.ply"}),
        (["a.ply"], ["a"], {"a.ply": "a"}),
        (["a.txt"], ["a.ply"], {"a.txt": "a.ply"}),
        (["a.txt", "a.ply"], ["a.ply", "b"], {"a.ply": "a.ply"}),
        (["a", "a.pcd"], ["a.ply", "a.pcd"], {"a": "a.ply", "a.pcd": "a.pcd"}),
        (["scan.3"], ["scan.1", "scan.2"], {}),
        (["scan.3"], ["scan.2"], {}),
        (["scan.2.txt"], ["scan.1", "scan.2"], {"scan.2.txt": "scan.2"}),
    ],
)
def test_that_a_scan_goes_by_its_name_with_any_ending(given, names, pairs):
    assert matched(given, names, "poses.json") == pairs
    assert matched(given[::-1], names[::-1], "poses.json") == pairs


@pytest.mark.parametrize(
    ("given", "names", "said"),
    [
        (["a"], ["a.ply", "a.pcd"], "^poses.json: a may be any of the scans a.ply, a.pcd; write"),
        (["a.txt", "a.csv"], ["a.ply"], "one name for the scan a.ply, got a.txt and a.csv"),
    ],
)
def test_that_a_name_of_two_scans_is_refused(given, names, said):
    with pytest.raises(InputError, match=said):
        matched(given, names, "poses.json")


def test_that_several_names_may_mean_the_same_scan_one_by_one():
    assert [meant(name, ["a.ply", "b"], "") for name in ("a", "a.ply", "a.txt", "c")] == [
        "a.ply",
        "a.ply",
        "a.ply",
        None,
    ]


def test_that_names_of_no_scan_are_told():
    assert unused(["a", "b"], ["a", "b"], Path("poses.json")) == ()
    (said,) = unused(["a", "b", "c"], ["b"], Path("x/poses.json"))
    assert said == "poses.json: 2 poses are of no scan that is here: a, c"
