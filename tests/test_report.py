import json
import math
import platform
import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from observed import run, scanset, view_of

from mvreg.errors import InputError
from mvreg.provenance import commit, git
from mvreg.report import build_report, versions
from mvreg.report_file import dumps, load_report
from mvreg.telling import telling_pair
from mvreg.types import Pair, Result, Verdict


def report(truth: bool = True) -> dict:
    return run(truth=truth)[-1].report


def test_has_what_is_promised():
    found = report()
    assert found["schema"] == 2
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
    assert telling_pair("c", result) is edge
    assert telling_pair("nobody", result) is None


def test_text_is_strict_json_and_exact(tmp_path):
    third = np.float64(1) / 3
    text = dumps({"schema": 1, "x": third, "bad": [math.nan, math.inf, np.float64("nan")]})

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
    private = {platform.node(), str(Path.home()), str(Path(__file__).parents[1])} - {"", "/"}
    shown = dumps({key: found[key] for key in ("machine", "commit", "versions")})
    assert not [word for word in private if word in shown]
    assert abs(datetime.now(UTC) - datetime.fromisoformat(found["finished"])).seconds < 60


def test_the_commit_is_the_checkouts_or_none():
    root = Path(__file__).parents[1]
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
