"""The pages on robustness say where every scan ended, and whether that is good enough."""

import json

import numpy as np
import pytest
from observed import run as observed_run

from mvreg.geometry import se3
from mvreg.report.json_file import dumps

NAMES = "abcdef"
WORLD = {name: se3.random(np.random.default_rng(index), 30.0) for index, name in enumerate(NAMES)}
OBJECTS = {name: "cup" if name < "e" else "jug" for name in NAMES}


@pytest.fixture(autouse=True)
def coarse_figures(monkeypatch):
    monkeypatch.setattr("experiments.common.style.DPI", 40)  # to be quick


def fabricate(placed="abcd", wrong="", components=(), objects=OBJECTS, confidence=None,
              errors=(0.004, 0.25), pairs=6, reasons=(), scans=NAMES):  # fmt: skip
    """A report of a made-up run, with some scans where they are and some turned by 90 degrees."""

    def model(names):
        turn = se3.exp(np.array([0, np.pi / 2, 0, 0, 0, 0]))
        return {name: WORLD[name] @ (turn if name in wrong else np.eye(4)) for name in names}

    there = placed + "".join(components)
    report = json.loads(dumps(observed_run()[-1].report))
    report.update(
        poses=model(placed), components=[{"poses": model(names)} for names in components],
        unregistered=[name for name in scans if name not in there], unit="mm", num_pairs=pairs,
        errors={"frame": placed[0], "mean": {"rotation": errors[0], "translation": errors[1]},
                "scans": {}},
        truth=WORLD, objects=objects, status="complete",
        scans=[{"name": name, "assessment": {"confidence": (confidence or {}).get(name)},
                "reason": dict(reasons).get(name)} for name in scans],
    )  # fmt: skip
    return report


def leave(root, experiment, overrides, report=None, error=None):
    from experiments.common import runs

    folder = root / experiment / runs.dirname(overrides)
    folder.mkdir(parents=True)
    if error is not None:
        (folder / "error.txt").write_text(error)
    else:
        (folder / "result.json").write_text(dumps(report))


def page(root, name):
    from experiments.common.runs import planned
    from experiments.report.build import robust_text
    from experiments.report.robust_pages import ROBUST

    parts = {each: planned(each, root) for each in ROBUST[name].experiments}
    return "\n".join([*robust_text(name, ROBUST[name], parts, root), ""])


def table_of(text, heading=None):
    """The first table of a page, or of a section of it: a dictionary for each row."""
    part = text.partition(f"## {heading}")[2] if heading else text
    part = part.partition("\n## ")[0]
    lines = [line.strip("|").split("|") for line in part.splitlines() if line.startswith("|")]
    head, _, *rows = [[cell.strip() for cell in cells] for cells in lines]
    return [dict(zip(head, cells, strict=True)) for cells in rows]


def test_every_scan_is_counted_once(tmp_path):
    for rng, report in enumerate([
        fabricate(confidence={"a": 0.9, "b": 0.99}), fabricate("abc", components=["ef"]),
        fabricate("abce", pairs=12, confidence={"e": 0.4}), fabricate("abcd", wrong="d"),
    ]):  # fmt: skip
        leave(tmp_path, "mixtures_drawn", ("+method=auto", "dataset=mixture", f"rng={rng}"), report)
    text = page(tmp_path, "mixtures")
    (row,) = [row for row in table_of(text) if row["scans of"] == "drawn at random"]
    assert row == {
        "scans of": "drawn at random", "objects": "", "of each": "", "scans": "24",
        "runs": "4 of 50", "correct": "15", "false positives": "2", "not placed": "7",
        "pairs / N": "1.00",
        "confidence": "0.900 to 0.990", "of the false": "0.400 to 0.400",
    }  # fmt: skip
    assert "e_R |" not in text  # of several objects


def test_every_false_placement_is_told(tmp_path):
    jobs = ("+method=auto", "dataset=mixture", "rng=7")
    leave(tmp_path, "mixtures_drawn", jobs, fabricate("abce", components=["df"], wrong="b"))
    part = page(tmp_path, "mixtures").partition("## False placements\n\n")[2].partition("\n\n")[0]
    where = "- mixtures_drawn, +method=auto dataset=mixture rng=7: "
    lines = [line.removeprefix(where) for line in part.splitlines()]
    assert [line[0] for line in lines] == ["b", "e", "d", "f"]
    assert lines[0].startswith("b, 90.0 degrees and")
    assert lines[1] == "e, of another object than a beside it"


def claims(text):
    part = text.partition("## Claims\n\n")[2].partition("\n\n")[0]
    return [line.removeprefix("- **").split("**: ") for line in part.splitlines()]


def test_claims_hold_until_one_scan_is_wrong(tmp_path):
    jobs = ("+method=auto", "dataset=mixture", "dataset.of=[bunny]")
    leave(tmp_path, "subsets", (*jobs, "rng=0"), fabricate())
    text = page(tmp_path, "subsets")
    (claim,) = claims(text)
    assert claim[0] == "holds" and claim[1].endswith(": subsets 0 in 1 of 102 runs.")
    assert "## False placements\n\nNone.\n" in text
    leave(tmp_path, "subsets", (*jobs, "rng=1"), fabricate("ab", wrong="b"))
    ((verdict, claim),) = claims(page(tmp_path, "subsets"))
    assert verdict == "does not hold" and "*subsets 2 in 2 of 102 runs*" in claim
    ((verdict, _),) = claims(page(tmp_path, "spoilt"))
    assert verdict == "not measured"
    assert "## False placements" not in page(tmp_path, "spoilt")


def test_a_foreign_scan_has_a_claim_of_its_own(tmp_path):
    jobs = ("+method=auto", "dataset=mixture", "dataset.of=[bunny,dragon]", "dataset.keep=[all,{}]")
    leave(tmp_path, "mixtures_foreign", [each.format(1) for each in jobs], fabricate("abcd"))
    leave(tmp_path, "mixtures_foreign", [each.format(3) for each in jobs], fabricate("abce"))
    (every, _), (one, text) = claims(page(tmp_path, "mixtures"))
    assert (every, one) == ("does not hold", "holds")
    assert text.endswith(": mixtures_foreign 0 in 1 of 6 runs.")


def test_what_cannot_be_placed_must_not_be(tmp_path):
    reasons = {"a": "ambiguous: 12 poses fit", "b": "ambiguous", "c": "no overlap"}
    shape = "dataset.shape={}".format
    leave(tmp_path, "shapes", ("+method=auto", "dataset=figurine", shape("sphere")),
          fabricate("a", reasons=reasons))  # fmt: skip
    text = page(tmp_path, "shapes")
    row = table_of(text)[0]
    assert (row["correct"], row["not placed"], row["ambiguous"]) == ("0", "6", "2")
    assert claims(text)[0][0] == "holds"
    leave(tmp_path, "shapes", ("+method=auto", "dataset=figurine", shape("box")), fabricate("ab"))
    assert claims(page(tmp_path, "shapes"))[0][0] == "does not hold"  # though it is right


def orders(root, dataset, runs):
    for rng, report in enumerate(runs):
        leave(root, "orders", ("+method=auto", f"dataset={dataset}", f"rng={rng}"), report)


def test_the_bars_are_of_medians_over_all_the_orders(tmp_path):
    whole = {"placed": NAMES, "objects": None}
    goods = [fabricate(**whole, errors=(0.0040, 0.25), pairs=7)] * 12
    bads = [fabricate(**whole, errors=(0.5, 9.0), pairs=90)] * 8
    orders(tmp_path, "bunny", goods + bads)
    orders(tmp_path, "dragon", bads + goods)
    text = page(tmp_path, "orders")
    assert [row["data set"] for row in table_of(text)] == ["bunny", "dragon", "buddha"]
    assert table_of(text)[0]["e_R"] == "0.0040"
    found = {(row["data set"], row[""]): row for row in table_of(text, "Bars")}
    assert found["bunny", "median e_R"] == {
        "data set": "bunny", "": "median e_R", "ours": "0.0040", "bar": "0.0045", "reached": "yes",
    }  # fmt: skip
    assert found["bunny", "median pairs / N"]["ours"] == "1.17"
    # Six scans a run here, ten in the bunny: 120 are not enough.
    assert found["bunny", "scans placed correctly"]["ours"] == "120"
    assert found["bunny", "scans placed correctly"]["reached"] == "**no**"
    assert found["buddha", "median e_R"]["ours"] == ""
    assert found["buddha", "median e_R"]["reached"] == "not all run"


def test_a_bar_is_missed_by_a_little(tmp_path):
    run = fabricate(NAMES, objects=None, errors=(0.0046, 0.30), pairs=8)
    orders(tmp_path, "bunny", [run] * 20)
    found = {row[""]: row["reached"] for row in table_of(page(tmp_path, "orders"), "Bars")[:4]}
    assert found == {
        "scans placed correctly": "**no**", "median e_R": "**no**", "median e_t (mm)": "yes",
        "median pairs / N": "**no**",
    }  # fmt: skip


@pytest.mark.parametrize("parts", [(), ("ef",)])
def test_errors_of_some_scans_only_are_starred(tmp_path, parts):
    orders(tmp_path, "bunny", [fabricate("abcd", objects=None, components=parts)])
    assert table_of(page(tmp_path, "orders"))[0]["e_R"] == "0.0040\\*"


def test_times_are_shown_where_they_are_asked_for(tmp_path):
    for rng, seconds in enumerate([3.0, 5.0, 100.0]):
        run = fabricate(NAMES, objects=None)
        run["seconds"]["total"] = seconds
        leave(tmp_path, "folders", ("+method=auto", "dataset=dragon", f"rng={rng}"), run)
        leave(tmp_path, "orders", ("+method=auto", "dataset=dragon", f"rng={rng}"), run)
    bunny, dragon, buddha, armadillo = table_of(page(tmp_path, "folders"))
    assert (dragon["runs"], dragon["correct"], dragon["time (s)"]) == ("3 of 20", "18", "5.0")
    assert dragon["e_R"] == "0.0040" and bunny["time (s)"] == buddha["time (s)"] == ""
    assert armadillo["data set"] == "armadillo_virtual"
    assert "time (s)" not in table_of(page(tmp_path, "orders"))[1]


def test_places_are_judged_in_resolutions_and_have_no_errors_in_mm(tmp_path):
    run = {**fabricate(NAMES, objects=None), "unit": "m", "resolution": 0.2}
    near, far = np.eye(4), np.eye(4)
    near[0, 3], far[0, 3] = 0.5, 0.7
    for rng, offset in enumerate([near, far]):
        poses = {**run["poses"], "b": (WORLD["b"] @ offset).tolist()}
        jobs = ("+method=auto", "dataset=tls_office", f"rng={rng}")
        leave(tmp_path, "environments", jobs, {**run, "poses": poses})
    text = page(tmp_path, "environments")
    (row,) = [row for row in table_of(text) if row["data set"] == "tls_office"]
    assert (row["runs"], row["correct"], row["false positives"]) == ("2 of 10", "11", "1")
    assert "e_t (mm)" not in row and claims(text)[0][0] == "does not hold"


def test_what_was_not_run_or_cannot_be_judged_is_said(tmp_path):
    job = ("+method=auto", "dataset=mixture", "dataset.of=[bunny]", "rng={}")
    named = [[each.format(rng) for each in job] for rng in range(3)]
    leave(tmp_path, "subsets", named[0], error="dataset.of='bunny' is not on this machine")
    report = fabricate()
    del report["truth"]
    report["config"]["dataset"] = {"of": ["nothing"]}
    leave(tmp_path, "subsets", named[1], report)
    leave(tmp_path, "subsets", named[2], {**fabricate(), "truth": None})
    text = page(tmp_path, "subsets")
    part = text.partition("## Without a result")[2]
    assert "is not on this machine: subsets auto mixture [bunny] 0\n" in part
    assert "dataset.of='nothing': dataset=nothing is not registered" in part
    assert "- no truth is known: subsets auto mixture [bunny] 2\n" in part
    assert "- not run: 99 runs" in part
    assert table_of(text)[0] == {"data set": "[bunny]", "runs": "0 of 34"}


def test_orders_are_drawn_with_medians_and_bars():
    from experiments.common.runs import Run
    from experiments.report.orders import draw_orders
    from experiments.report.outcomes import rows

    good = fabricate(NAMES, objects=None, errors=(0.002, 0.2))
    poor = fabricate("abcde", objects=None, errors=(0.006, 0.5))
    found = rows(
        {"orders": [Run(None, ("dataset=bunny", f"rng={i}"), r, None)
                    for i, r in enumerate([poor, good, good])]}, ["dataset"],
    )  # fmt: skip
    figure = draw_orders(found)
    rotation, _, pairs = figure.axes
    marks, hollow, median, goal = rotation.lines
    assert list(marks.get_ydata()) == [0.002, 0.002, 0.006]
    assert list(hollow.get_ydata()) == [0.006] and hollow.get_markerfacecolor() == "white"
    assert list(median.get_ydata()) == [0.002] * 2 and list(goal.get_ydata()) == [0.0045] * 2
    assert list(pairs.lines[-1].get_ydata()) == [1.3] * 2


def test_the_figure_is_drawn_only_where_there_are_runs(tmp_path):
    from experiments.report.figures import orders as drawn

    assert drawn("orders", tmp_path, tmp_path / "orders.png") is None
    orders(tmp_path, "bunny", [fabricate(NAMES, objects=None)])
    assert drawn("orders", tmp_path, tmp_path / "orders.png") == tmp_path / "orders.png"
    assert (tmp_path / "orders.png").stat().st_size > 1000
