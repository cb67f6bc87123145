"""What scans are called means nothing to the code."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mvreg
from mvreg.report.deciding_pair import deciding_pair
from mvreg.report.run_folder import pose_files, write_models, write_placements
from mvreg.testing.scans import blob_scans
from mvreg.types import ScanSet

ODD = [
    "model", "", " ", "a/b", "../../up", "..", "-x", "--help", "component 2", "component_2",
    "A.ply", "a.ply", "é", "e\u0301", "ß", "ss", "x" * 300, "日" * 120, "a\nb", "a\0b", "none",
]  # fmt: skip
STRATEGIES = ["grow", "sequential", "best_first"]


@cache
def named(*names: str) -> ScanSet:
    """The scans of `blob_scans`, called something else."""
    plain = blob_scans(3)
    scans = [replace(s, name=n) for s, n in zip(plain.scans, names, strict=True)]
    return replace(plain, scans=scans, poses=None)


def placed(names, strategy):
    return mvreg.register(named(*names), changes={"strategy": strategy})


@cache
def plain(strategy):
    return placed(("p", "q", "r"), strategy)


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize(
    "names",
    [
        ("a", "model", "b"),
        ("model", "a", "b"),
        ("", "..", "component 2"),
        ("A.ply", "a.ply", "model"),
    ],
)
def test_poses_are_the_same_whatever_the_names(names, strategy):
    found, expected = placed(names, strategy), plain(strategy)
    other = dict(zip(("p", "q", "r"), names, strict=True))
    assert {other[name] for name in expected.poses} == set(found.poses)
    for name, pose in expected.poses.items():
        np.testing.assert_array_equal(found.poses[other[name]], pose)
    assert [(p.source, p.target) for p in found.pairs] == [
        (other[p.source], other[p.target]) for p in expected.pairs
    ]
    for name in expected.poses:
        before, after = deciding_pair(name, expected), deciding_pair(other[name], found)
        assert (before and other[before.source]) == (after and after.source)


def test_every_name_has_a_file_of_its_own_within_the_folder(tmp_path):
    files = pose_files(ODD)
    assert len({file.casefold() for file in files.values()}) == len(ODD)
    for file in files.values():
        (tmp_path / file).write_text("pose")
    assert len(list(tmp_path.iterdir())) == len(ODD)


@pytest.mark.parametrize(
    "names", [("../../up", "x" * 300, "component_2"), ("日" * 120, "", "model")]
)
def test_a_run_folder_holds_all_that_is_written(names, tmp_path):
    scans, folder = named(*names), tmp_path / "deep" / "run"
    folder.mkdir(parents=True)
    result = mvreg.types.Result(names[0], {n: np.eye(4) for n in names}, (), ())
    write_placements(folder, scans, result)
    write_models(folder, scans, result)
    written = [p for p in tmp_path.rglob("*") if p.is_file()]
    assert len(written) == 4
    assert all(p.is_relative_to(folder) for p in written)
