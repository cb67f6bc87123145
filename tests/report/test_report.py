import json
import math
import platform
import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from observed import apart, run, scanset, view_of

from mvreg.errors import InputError
from mvreg.report.build import build_report
from mvreg.report.deciding_pair import deciding_pair
from mvreg.report.json_file import SCHEMA, dumps, load_report
from mvreg.report.provenance import commit, git, versions
from mvreg.types import Pair, Result, Verdict


def report(truth: bool = True) -> dict:
    return run(truth=truth)[-1].report


def test_has_what_is_promised():
    found = report()
    assert found["schema"] == SCHEMA
    assert found["method"] == "grow"
    assert found["dataset"] == "plates"
    assert found["rng"] == 3
    assert found["unit"] == "mm"
    assert found["reference"] == "a.ply"
    assert found["unregistered"] == ["c.ply"]
    assert found["status"] == "incomplete"
    assert found["num_pairs"] == 3
    assert found["poses"]["b.ply"] == [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    assert set(found["poses"]) == {"a.ply", "b.ply"}
    assert found["config"] == {"seed": {"top_fraction": 0.3}}
    assert found["consistency"]["rms"] < 0.01
    assert found["consistency"]["rms_resolutions"] == found["consistency"]["rms"]


def test_stages_of_the_pairs_are_summed_and_those_given_win():
    assert report()["seconds"] == {"load": 0.5, "total": 1.5, "seed": 0.5, "refine": 0.5}
    pair = Pair("b.ply", "a.ply", Verdict(True, 1.0, 2.0, ""), np.eye(4), 0.6, 0.01, {"seed": 0.25})
    alone = Result("a.ply", {"a.ply": np.eye(4)}, ("b.ply", "c.ply"), (pair, pair))
    about = {"method": "m", "rng": None, "config": {}}
    for given, expected in (({}, 0.5), ({"seed": 0.125}, 0.125)):
        found = build_report(scanset(), [], alone, seconds=given, **about)
        assert found["seconds"] == {"seed": expected}


def test_errors_are_in_the_table_and_the_totals():
    found = report()
    rows = {row["name"]: row for row in found["scans"]}
    assert found["errors"]["mean"] == {"rotation": 0, "angle_deg": 0, "translation": 0}
    assert rows["b.ply"]["errors"] == found["errors"]["scans"]["b.ply"]
    assert rows["c.ply"]["errors"] is None


def test_no_truth_no_errors():
    assert report(truth=False)["errors"] is None


def test_rows_say_how_each_scan_came_in():
    rows = {row["name"]: row for row in report()["scans"]}
    assert [rows[n]["status"] for n in rows] == ["reference", "placed", "not placed"]
    assert rows["b.ply"]["overlap"] == 0.8
    assert rows["b.ply"]["trimmed_rmse"] == 0.5
    assert rows["a.ply"]["overlap"] is None
    # The attempt with a score tells more than the one without a candidate.
    assert rows["c.ply"]["trimmed_rmse"] == 2.0
    assert rows["c.ply"]["attempts"] == 2


def test_a_scan_placed_as_the_target_of_a_pair_has_a_row_too():
    edge = Pair("b", "c", Verdict(True, 1.0, 2.0, "tree edge"), np.eye(4), 0.6, 0.01)
    result = Result("b", {"b": np.eye(4), "c": np.eye(4)}, (), (edge,))
    assert deciding_pair("c", result) is edge
    assert deciding_pair("nobody", result) is None


def test_text_is_strict_json_and_exact(tmp_path):
    third = np.float64(1) / 3
    text = dumps({"schema": SCHEMA, "x": third, "bad": [math.nan, math.inf, np.float64("nan")]})

    def refuse(word: str) -> None:
        pytest.fail(f"{word} is not JSON")

    found = json.loads(text, parse_constant=refuse)
    assert found["x"] == float(third)
    assert found["bad"] == [None, None, None]
    (tmp_path / "result.json").write_text(text)
    assert load_report(tmp_path) == load_report(tmp_path / "result.json") == found


@pytest.mark.parametrize(
    ("text", "said"),
    [(None, "run folder"), ("{", "not JSON"), ("[]", "schema"), ('{"schema": 99}', "99")],
)
def test_what_is_no_report_is_refused(tmp_path, text, said):
    if text is not None:
        (tmp_path / "result.json").write_text(text)
    with pytest.raises(InputError, match=said):
        load_report(tmp_path)


def test_complete_and_interrupted():
    data = scanset()
    views = [view_of(scan) for scan in data.scans]
    everything = Result("a.ply", {s.name: np.eye(4) for s in data.scans}, (), ())
    about = {"method": "m", "rng": None, "seconds": {}, "config": {}}
    assert build_report(data, views, everything, **about)["status"] == "complete"
    cut = build_report(data, views, everything, **about, interrupted=True)
    assert cut["status"] == "interrupted"


def test_says_where_it_was_made_and_nothing_private():
    found = report()
    assert set(found["machine"]) == {"cpu", "cores", "threads", "system"}
    assert found["machine"]["cpu"] and found["machine"]["cores"] >= 1
    private = {platform.node(), str(Path.home()), str(Path(__file__).parents[2])} - {"", "/"}
    shown = dumps({key: found[key] for key in ("machine", "commit", "versions")})
    assert not [word for word in private if word in shown]
    assert abs(datetime.now(UTC) - datetime.fromisoformat(found["finished"])).seconds < 60


def test_the_commit_is_the_checkouts_or_none():
    root = Path(__file__).parents[2]
    if git(root, "rev-parse", "HEAD") is None:
        assert commit() is None
    else:
        assert re.fullmatch(r"[0-9a-f]{12,}(-changed)?", commit())
    assert git(root, "no-such-word") is None


def test_the_size_of_the_model_is_kept():
    assert report()["model_points"] == 800
    data = scanset()
    bare = Result("a.ply", {"a.ply": np.eye(4)}, ("b.ply", "c.ply"), ())
    found = build_report(data, [], bare, method="m", rng=None, seconds={}, config={})
    assert found["model_points"] is None


def test_versions_name_what_can_change_the_answer():
    assert {"python", "mvreg", "numpy", "scipy"} <= set(versions())


def parts(truth: bool = True) -> dict:
    """The report of a run that ends in two partial models."""
    return apart(truth)[-1].report


def test_partial_models_have_poses_of_their_own():
    found = parts()
    assert found["status"] == "incomplete"
    assert set(found["poses"]) == {"a.ply", "b.ply"}
    assert found["unregistered"] == ["s.ply", "x.ply"]
    (second,) = found["components"]
    assert (second["number"], second["reference"]) == (2, "d.ply")
    assert second["poses"]["d.ply"] == np.eye(4).tolist()
    assert second["poses"]["e.ply"][0][3] == 3
    assert second["consistency"]["rms"] < 0.01
    # Of the three attempts across its border two were rejected, this one more narrowly.
    assert (second["attempts"], second["reason"]) == (2, "too little overlap")


def test_everything_placed_in_two_models_is_not_complete():
    data = scanset()
    poses = {scan.name: np.eye(4) for scan in data.scans}
    left = {"a.ply": poses.pop("a.ply")}
    result = Result("b.ply", poses, (), (), components=(left,))
    about = {"method": "m", "rng": None, "seconds": {}, "config": {}}
    views = [view_of(scan) for scan in data.scans]
    assert build_report(data, views, result, **about)["status"] == "incomplete"


def test_a_wrong_pose_within_a_partial_model_shows():
    found = parts()
    errors = found["components"][0]["errors"]
    assert errors["frame"] == "d.ply"
    assert errors["max"]["translation"] == pytest.approx(0.5)
    assert errors["mean"]["translation"] == pytest.approx(0.25)
    rows = {row["name"]: row for row in found["scans"]}
    assert rows["e.ply"]["errors"]["translation"] == pytest.approx(0.5)
    assert found["errors"]["max"]["translation"] == 0, "the reference's is told by itself"
    assert parts(truth=False)["components"][0]["errors"] is None


def test_rows_say_where_each_scan_stands():
    rows = {row["name"][0]: row for row in parts()["scans"]}
    assert {name: row["status"] for name, row in rows.items()} == {
        "a": "reference", "b": "placed", "d": "component 2", "e": "component 2",
        "s": "ambiguous", "x": "not placed",
    }  # fmt: skip
    assert [row["component"] for row in rows.values()] == [1, 1, 2, 2, None, None]
    assert rows["s"]["reason"] == "ambiguous: another pose is as probable"
    told = rows["s"]["answers"]
    assert (told["source"], told["target"]) == ("s.ply", "a.ply")
    assert [(one["confidence"], one["apart"]) for one in told["poses"]] == [(0.5, 0.0), (0.4, 7.0)]
    assert told["poses"][1]["angle_deg"] == pytest.approx(180)
    assert [row["answers"] for row in rows.values()].count(None) == 5
    assert rows["x"]["reason"] == "accepted at first, then withdrawn"
    assert rows["e"]["reason"] == "surfaces agree", "not the attempt to leave its partial model"
    assert rows["d"]["reason"] is None
    assert rows["x"]["assessment"] is None


def test_rows_say_how_far_a_pose_is_to_be_trusted():
    found = parts()
    rows = {row["name"][0]: row["assessment"] for row in found["scans"]}
    assert found["grades"]["tolerance"] == found["grades"]["tolerance_resolutions"] == 0.5
    for name in "abde":
        assert 0 <= rows[name]["confidence"] <= 1
        assert rows[name]["coverage"] > 0.9
        assert rows[name]["inlier_ratio"] == 1.0
        assert rows[name]["grade"] == "red", "plates may slide"
        assert rows[name]["reason"].startswith("ambiguous")
        assert rows[name]["strength"] == pytest.approx([0, 0, 1], abs=1e-6)
    assert rows["b"]["uncertainty"]["angle_deg"] == pytest.approx(math.degrees(1e-3))
    assert rows["b"]["uncertainty"]["translation"] > 0.1
    assert rows["a"]["uncertainty"] is None
    assert found["covariances"]["b.ply"][3][3] == 0.01


def test_links_and_pairs_have_their_confidence():
    found = parts()
    first, second = found["links"]
    assert ({first["source"], first["target"]}, first["component"]) == ({"a.ply", "b.ply"}, 1)
    assert ({second["source"], second["target"]}, second["component"]) == ({"d.ply", "e.ply"}, 2)
    assert 0 <= first["confidence"] <= 1
    assert first["rms"] == first["rms_resolutions"] < 0.05
    assert first["adjusted_points"] == 400
    assert first["adjusted_rms"] == pytest.approx(math.sqrt((300 * 0.09 + 100 * 0.01) / 400))
    assert second["adjusted_rms"] is None
    assert [pair["confidence"] for pair in found["pairs"]] == [0.98, 0.97, 0.4, 0.8, 0.91]
    assert found["pairs"][2] == {
        "source": "e.ply", "target": "a.ply", "verdict": "rejected",
        "reason": "too little overlap", "confidence": 0.4,
        "T_target_source": np.eye(4).tolist(), "answers": [],
        "evidence": {"surface_overlap": 0.333333, "residual": 2.0},
    }  # fmt: skip
    assert [pair["confidence"] for pair in report()["pairs"]] == [None] * 3


def test_a_report_of_the_first_schema_is_read(tmp_path):
    new = {"components", "grades", "links", "pairs", "covariances"}
    old = {key: value for key, value in report().items() if key not in new}
    (tmp_path / "result.json").write_text(dumps({**old, "schema": 1}))
    found = load_report(tmp_path)
    assert found["schema"] == SCHEMA
    assert not new & set(found), "what an old report does not say stays unsaid"


def test_what_was_accepted_elsewhere_is_not_how_a_scan_came_in():
    inside = Pair("b", "a", Verdict(True, 1.0, 2.0, "inside"), np.eye(4), 0.6, 0.01)
    across = Pair("b", "c", Verdict(True, 0.1, 2.0, "across"), np.eye(4), 0.6, 0.01)
    poses = {"a": np.eye(4), "b": np.eye(4)}
    result = Result("a", poses, (), (inside, across), components=({"c": np.eye(4)},))
    assert deciding_pair("b", result) is inside
    assert deciding_pair("c", result) is None
