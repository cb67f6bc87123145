"""What is placed correctly, false positives, or not placed: any wrong relative pose counts."""

import json
from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.report.json_file import SCHEMA, dumps

RNG = np.random.default_rng(0)
NAMES = "abcdefgh"
#: Scans a to e are of a cup, f to h of a jug.
WORLD = {name: se3.random(RNG, 50.0) for name in NAMES}
OBJECTS = {name: "cup" if name < "f" else "jug" for name in NAMES}
FRAME = se3.random(RNG, 50.0)


def placed(names, wrong=None, frame=FRAME):
    """The true poses of some scans in one frame, but those that are `wrong` by a motion."""
    poses = {name: frame @ WORLD[name] for name in names}
    return {name: T @ (wrong or {}).get(name, np.eye(4)) for name, T in poses.items()}


def off(degrees=0.0, shift=0.0):
    return se3.exp(np.array([np.radians(degrees), 0, 0, 0, shift, 0]))


def judge(models, left="", objects=OBJECTS, world=WORLD):
    from experiments.accuracy.placements import Tolerance, Truth, placements

    found = placements(models, list(left), Truth(world, objects), Tolerance(2.0, 5.0))
    assert found.total == sum(map(len, models)) + len(left)
    return (
        "".join(found.right), "".join(each.scan for each in found.false), "".join(found.left),
        "".join(found.unknown),
    )  # fmt: skip


def test_all_right_in_any_frame():
    assert judge([placed("abcde")]) == ("abcde", "", "", "")
    assert judge([placed("abc"), placed("fgh", frame=np.eye(4))], "de") == ("abcfgh", "", "de", "")


def test_two_partial_models_of_one_object_are_right_by_themselves():
    other = placed("cd", frame=se3.random(RNG, 9.0))
    assert judge([placed("abe"), other]) == ("abecd", "", "", "")
    # ... but not in one frame.
    assert judge([{**placed("abe"), **other}]) == ("abe", "cd", "", "")


@pytest.mark.parametrize(
    ("motion", "right"),
    [(off(1.9), True), (off(2.1), False), (off(shift=4.9), True), (off(shift=5.1), False)],
)
def test_the_tolerance_counts_in_both_ways(motion, right):
    found = judge([placed("abcd", {"c": motion})])
    assert found == (("abcd", "", "", "") if right else ("abd", "c", "", ""))


def test_a_wrong_reference_is_the_one_that_is_wrong():
    assert judge([placed("abcd", {"a": off(30)})]) == ("bcd", "a", "", "")


def test_scans_of_another_object_are_false_however_they_are_placed():
    assert judge([placed("abcf")]) == ("abc", "f", "", "")
    assert judge([placed("abfgh")]) == ("fgh", "ab", "", "")
    assert judge([placed("af")]) == ("", "af", "", "")


def test_where_no_two_stand_right_all_are_false():
    assert judge([placed("ab", {"b": off(90)})]) == ("", "ab", "", "")
    assert judge([placed("abc", {"b": off(90), "c": off(0, 40)})]) == ("", "abc", "", "")


def test_a_scan_alone_is_not_placed():
    assert judge([placed("a"), placed("f")], "bc") == ("", "", "bcaf", "")
    assert judge([{}], "ab") == ("", "", "ab", "")


def test_scans_without_a_truth_are_not_judged():
    world = {name: WORLD[name] for name in "abc"}
    assert judge([placed("abd")], world=world) == ("ab", "", "", "d")
    assert judge([placed("de")], world=world) == ("", "", "", "de")
    assert judge([placed("ad")], world=world) == ("", "", "", "ad")


def test_what_is_false_is_told():
    from experiments.accuracy.placements import Tolerance, Truth, placements

    model = placed("abcf", {"c": off(30, 0)})
    found = placements([model], [], Truth(WORLD, OBJECTS), Tolerance(2.0, 5.0))
    first, second = map(str, found.false)
    assert first.startswith("c, 30.0 degrees and ") and first.endswith(" off beside a")
    assert second == "f, of another object than a beside it"
    assert found.false[0].angle == pytest.approx(30) and found.false[1].beside == "a"


def test_the_tolerance_is_in_mm_or_in_resolutions():
    from experiments.accuracy.placements import Tolerance

    shifts = {unit: Tolerance.of({"unit": unit, "resolution": 0.3}).shift
              for unit in ("mm", "cm", "m", "file")}  # fmt: skip
    assert shifts == pytest.approx({"mm": 5, "cm": 0.5, "m": 0.9, "file": 0.9})


TINY = {"of": ["tiny points=300 views=3 shape=sphere", "tiny points=300 views=2 shape=blob-0"]}


def run_of(tmp_path, **changes):
    """A run's folder, all its scans in one frame, and the data set behind it."""
    scans = mvreg.dataset("mixture", 4, **TINY)
    report = {
        "schema": SCHEMA, "status": "complete", "dataset": scans.name, "rng": 4, "unit": "mm",
        "resolution": 3.0, "poses": scans.poses, "unregistered": [], "errors": None,
        "config": {"dataset": {**TINY, "order": "shuffle", "scramble": True}}, **changes,
    }  # fmt: skip
    (tmp_path / ".hydra").mkdir(exist_ok=True)
    (tmp_path / ".hydra/overrides.yaml").write_text("- dataset=mixture\n- +experiment=x\n")
    (tmp_path / "result.json").write_text(dumps(report))
    return scans


def test_the_truth_of_a_run_is_loaded_again(tmp_path, capsys):
    from experiments.accuracy import placements
    from experiments.accuracy.truth import placements_of
    from experiments.common.runs import read

    run_of(tmp_path)
    run = read(tmp_path)
    assert run.overrides == ("dataset=mixture",)
    found = placements_of(run)
    assert sorted(found.right) == [f"tiny_sphere_{i:02d}" for i in range(3)]
    assert sorted(e.scan for e in found.false) == ["tiny_blob-0_00", "tiny_blob-0_01"]
    placements.main([str(tmp_path)])
    assert (
        "3 correct, 2 false positives, 0 not placed\n  false positive: tiny_blob-0_0"
        in capsys.readouterr().out
    )
    placements.main([str(tmp_path / "nothing")])
    assert "nothing: not run" in capsys.readouterr().out


def test_components_and_the_truth_that_a_result_holds_are_used(tmp_path, monkeypatch):
    from experiments.accuracy.truth import placements_of
    from experiments.common.runs import read

    scans = run_of(tmp_path)
    parts = [{n: T for n, T in scans.poses.items() if scans.objects[n] == o}
             for o in ("tiny_sphere", "tiny_blob-0")]  # fmt: skip
    others = [{"number": 2, "poses": poses} for poses in parts[1:]]
    run_of(tmp_path, poses=parts[0], components=others, truth=scans.poses, objects=scans.objects)
    monkeypatch.setattr(mvreg, "dataset", None)  # not needed
    found = placements_of(read(tmp_path))
    assert len(found.right) == 5 and not found.false
    run = read(tmp_path)
    assert placements_of(replace(run, report={**run.report, "truth": None})) is None


def test_a_truth_that_is_not_the_runs_is_refused(tmp_path):
    from experiments.accuracy.truth import placements_of
    from experiments.common.runs import read

    names = [f"tiny_sphere_{i:02d}" for i in range(2)]
    errors = {"frame": names[0], "scans": {name: {"angle_deg": 0.0} for name in names}}
    run_of(tmp_path, errors=errors)
    assert placements_of(read(tmp_path)) is not None
    report = json.loads((tmp_path / "result.json").read_text())
    (tmp_path / "result.json").write_text(dumps({**report, "rng": 5}))
    with pytest.raises(InputError, match="run them again"):
        placements_of(read(tmp_path))
