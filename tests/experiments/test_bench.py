"""The benchmarks: what is told of numbers, what is run when, what is kept, and the page."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def coarse_figures(monkeypatch):
    monkeypatch.setattr("experiments.common.style.DPI", 40)  # to be quick


def made_up_context(code="c0de", commit="0123456789ab"):
    from experiments.bench.records import Context

    machine = {"cpu": "Abacus 3", "cores": 2, "threads": 2, "system": "Linux x"}
    return Context(code, commit, machine, {"python": "3.11", "mvreg": "0.1.0"})


def made_up_answer(seconds, **changes):
    stages = {"refine": 0.5 * seconds, "adjust": 0.25 * seconds, "other": 0.25 * seconds}
    return {
        "seconds": seconds, "stages": stages, "load": 0.4, "imports": 1.0, "held_mb": 100.0,
        "peak_mb": 250.0, "scans": 10, "placed": 10, "parts": [], "false": 0, "pairs": 12,
        "rotation": 0.004, "translation": 0.3, "points": 1000, "late_imports": [],
    } | changes  # fmt: skip


def made_up(case, number=0, answer=None, error=None, **changes):
    """A record of a case."""
    from experiments.bench import run
    from experiments.bench.process import Measured

    found = run.record(case, number, Measured(answer, error, 7.0, 0.01), made_up_context())
    return replace(found, finished="2001-02-03T04:05:06+00:00", **changes)


def cases(**options):
    from experiments.bench.plan import Options, plan

    return list(plan(Options(**options)))


def everything():
    """Records of all parts: FCPMA takes 1, 2, 3 s on real scans, the others times as long."""
    slower = {"fcpma": 1.0, "fcpma+joint": 1.6, "auto": 2.0, "open3d_multiway": 30.0,
              "kiss_gicp": 10.0, "kiss_gicp+threads": 4.0}  # fmt: skip
    found = []
    for case, number in cases():
        if case.part == "methods":
            found.append(made_up(case, number, made_up_answer((number + 1) * slower[case.row])))
        elif case.part == "start":
            found.append(made_up(case, number, wall=3.0 if case.group == "run" else 0.5))
        elif case.part == "micro":
            rows = [{"group": "nearest", "name": f"test_aligned[{name}]", "median": 1e-3 * times,
                     "min": 1e-4, "max": 1e-2, "rounds": 9}
                    for name, times in (("mvreg", 1), ("scipy", 4))]  # fmt: skip
            found.append(made_up(case, number, {"benchmarks": rows}))
        elif case.row == "fcpma" and case.size > 40:
            found.append(made_up(case, number, error="longer than 5 s", wall=5.0))
        else:
            power = {"scans": 1.1, "points": 0.5}[case.part] * (2 if case.row == "fcpma" else 1)
            answer = made_up_answer(case.size**power, scans=case.size, placed=case.size,
                                    pairs=1.25 * case.size)  # fmt: skip
            found.append(made_up(case, number, answer))
    return found


def test_the_median_and_the_extremes_are_of_what_is_known():
    from experiments.bench.numbers import ratio
    from mvreg.report.comparison.spread import spread

    found = spread([3.0, None, 1.0, float("nan"), 2.0])
    assert (found.median, found.least, found.most, found.count) == (2.0, 1.0, 3.0, 3)
    assert found.shown(".1f") == "2.0 (1.0 to 3.0)"
    assert spread([2.0]).shown(".1f") == "2.0"
    assert spread([None]) is None
    assert ratio(spread([30.0, 60.0, 10.0]), found) == 15.0
    assert ratio(None, found) is None and ratio(found, spread([0.0])) is None


def test_a_power_law_is_found_again_and_its_end_is_told_apart():
    from experiments.bench.numbers import growth

    law = growth([10, 20, 40, 80], [3 * size**1.1 for size in (10, 20, 40, 80)])
    assert law.exponent == pytest.approx(1.1) and law.last == pytest.approx(1.1)
    assert law.at(1000) == pytest.approx(3 * 1000**1.1)
    # A fixed cost flattens the beginning, and sizes may be missing.
    law = growth([80, 10, 20, 40], [50 + 6400.0, None, 50 + 400.0, 50 + 1600.0])
    assert law.exponent < law.last < 2
    assert growth([10, 20], [1.0, None]) is None


def test_a_suffix_changes_the_method():
    from experiments.bench.free import changes, plain

    assert [plain(name) for name in ("fcpma+joint", "kiss_gicp+threads", "auto")] == [
        "fcpma", "kiss_gicp", "auto",
    ]  # fmt: skip
    assert changes("fcpma+joint") == {"adjust": "joint"}
    assert changes("fcpma") == changes("kiss_gicp+threads") == {}


def test_every_method_leads_a_round_and_all_are_run_in_each():
    found = cases(parts=["methods"], datasets=["bunny"], rounds=4)
    rounds = [[case.row for case, number in found if number == n] for n in range(4)]
    assert [names[0] for names in rounds] == [
        "fcpma", "fcpma+joint", "auto", "open3d_multiway",
    ]  # fmt: skip
    assert rounds[0] == [*rounds[1][-1:], *rounds[1][:-1]] and len(rounds[0]) == 6
    assert all(sorted(names) == sorted(rounds[0]) for names in rounds)


def test_peers_are_run_where_they_are_wanted_and_do_not_grow():
    found = {(case.part, case.group, case.row) for case, _ in cases()}
    assert ("methods", "bunny", "kiss_gicp") in found
    assert ("methods", "dragon", "auto") in found and ("scans", "300", "auto") in found
    assert not {key for key in found if key[2] == "kiss_gicp" and key[1] != "bunny"}
    assert not {key for key in found if key[2] == "fcpma+joint" and key[0] != "methods"}
    more = {(case.group, case.row) for case, _ in cases(peers_on=["dragon"])}
    assert ("dragon", "kiss_gicp") in more and ("bunny", "kiss_gicp") not in more


def test_growth_begins_with_the_smallest_and_keys_know_no_folder():
    found = cases(parts=["scans"], methods=["auto"], sizes=[40, 10])
    assert [case.size for case, _ in found] == [10, 40]
    other = cases(parts=["scans"], methods=["auto"], sizes=[40, 10], scans=Path("elsewhere"))
    assert [case.key for case, _ in found] == [case.key for case, _ in other]
    assert found[0][0].key != found[1][0].key
    again = cases(parts=["scans"], methods=["auto"], sizes=[10], growth_rounds=2)
    assert [case.spec["rng"] for case, _ in again] == [1, 2]  # another order each time
    finer = cases(parts=["scans"], methods=["auto"], sizes=[10], scan_points=20_000)
    assert finer[0][0].key != found[0][0].key


def test_a_file_says_what_was_kept(tmp_path):
    from experiments.bench.records import load, save

    file = tmp_path / "deep" / "bench.json"
    assert load(file) == []
    records = everything()
    save(file, records)
    assert load(file) == records
    assert len(json.loads(file.read_text())["contexts"]) == 1
    file.write_text("[]")
    with pytest.raises(ValueError, match="schema 1"):
        load(file)


def test_what_is_done_is_not_run_again_and_what_failed_is(tmp_path):
    from experiments.bench.records import done

    case, _ = cases(parts=["methods"])[0]
    good = made_up(case, 0, made_up_answer(1.0))
    failed = made_up(case, 1, error="no scans")
    late = made_up(case, 2, error="longer than 5 s", wall=5.0)
    now = made_up_context()
    assert done([good, failed, late], now, limit=5) == {(case.key, 0), (case.key, 2)}
    assert done([late], now, limit=50) == set()
    # Another commit of the same code is the same; other code is not.
    assert done([good], made_up_context(commit="feed"), 5) == {(case.key, 0)}
    assert done([good], made_up_context(code="other"), 5) == set()


def test_only_what_compares_with_the_last_run_is_told():
    from experiments.bench.records import latest

    (a, _), (b, _) = cases(parts=["methods"], datasets=["bunny"])[:2]
    old = made_up(b, 0, made_up_answer(9.0), context=made_up_context(code="old"))
    failed, good = made_up(a, 0, error="no scans"), made_up(a, 0, made_up_answer(1.0))
    assert latest([old, failed, good], "methods") == [good]
    assert latest([old], "methods") == [old] and latest([old], "start") == []


def test_the_name_of_the_code_follows_the_code(tmp_path):
    from experiments.bench.records import digest

    (tmp_path / "experiments" / "bench").mkdir(parents=True)
    (tmp_path / "mvreg" / "tests").mkdir(parents=True)
    for name in ("experiments/bench/child.py", "mvreg/a.py", "mvreg/tests/b.py", "mvreg/c.md"):
        (tmp_path / name).write_text("1")
    first = digest(tmp_path)
    (tmp_path / "mvreg/tests/b.py").write_text("2")
    (tmp_path / "mvreg/c.md").write_text("2")
    assert digest(tmp_path) == first
    (tmp_path / "mvreg/a.py").write_text("2")
    assert digest(tmp_path) != first


def test_the_ratios_are_of_the_medians_of_the_same_data_set():
    from experiments.bench.tables import methods, stages

    found = [record for record in everything() if record.part == "methods"]
    table = methods(found)
    rows = {tuple(row[:2]): dict(zip(table.heads, row, strict=True)) for row in table.rows}
    assert list(rows)[::2][:2] == [("bunny", "fcpma"), ("bunny", "auto")]
    fcpma, auto = rows["bunny", "fcpma"], rows["bunny", "auto"]
    assert fcpma["time (s)"] == "2.00 (1.00 to 3.00)" and fcpma["runs"] == "3"
    assert fcpma["open3d_multiway takes times"] == "30.00"
    assert auto["kiss_gicp takes times"] == "5.00"
    assert rows["dragon", "fcpma"]["kiss_gicp takes times"] == ""
    assert ["bunny", "auto", "", "", "", "", "2.000", "", "", "1.000", "1.000", "4.000"] in (
        stages(found).rows
    )


def test_the_worst_of_several_runs_is_told_of_placements():
    from experiments.bench.tables import methods

    case, _ = cases(parts=["methods"])[0]
    runs = [made_up(case, 0, made_up_answer(1.0)),
            made_up(case, 1, made_up_answer(1.0, placed=8, false=1)),
            made_up(case, 2, error="no scans")]  # fmt: skip
    assert methods(runs).rows[0][2:4] == ["8 of 10", "1"]
    assert methods(runs[2:]).rows[0][2] == "*failed*"


def test_bars_are_reached_or_missed_as_the_numbers_say():
    from experiments.report.bench_bars import bars

    rows = {row[0]: row[1:] for row in bars(everything()).rows}
    assert rows["time on bunny, fcpma (s)"] == ["2", "at most 1", "**no**"]
    assert rows["open3d_multiway takes times as long as fcpma on bunny"] == [
        "30", "at least 20", "yes",
    ]  # fmt: skip
    # The fastest variant counts.
    assert rows["kiss_gicp takes times as long as fcpma on bunny"] == ["4", "at least 5", "**no**"]
    joint = "open3d_multiway takes times as long as fcpma+joint on bunny"
    assert rows[joint] == ["18.75", "at least 20", "**no**"]
    assert rows["exponent of the time in the number of scans, auto"] == [
        "1.1", "at most 1.15", "yes",
    ]  # fmt: skip
    assert rows["most pairs / N, auto"] == ["1.25", "at most 1.5", "yes"]
    assert rows["`python -m mvreg --help`, start to prompt (s)"] == ["0.5", "at most 1", "yes"]
    assert {row[3] for row in bars([]).rows} == {"not measured"}


def test_the_page_has_tables_figures_and_where_it_all_comes_from(tmp_path):
    from experiments.bench.records import save
    from experiments.report import build

    save(tmp_path / "bench/bench.json", everything())
    out = tmp_path / "out"
    build.main(tmp_path / "experiments", out, figures=False)
    from experiments.report.bench_page import write

    write(tmp_path / "bench/bench.json", out, figures=True)
    text = (out / "bench.md").read_text()
    assert "| bunny | fcpma | 10 of 10 | 0 | 12 |" in text
    assert "| fcpma | 80 | *too long* |" in text and "- scans, 80, fcpma: longer than 5 s" in text
    assert "| nearest | mvreg | 1.000 | 0.100 | 9 | 4.0 |" in text
    assert "Scans in the files' order." in text and "10 scans of the same column" in text
    assert "- Machine: Abacus 3, 2 cores, 2 threads a run" in text
    assert "0.01 cores were busy with something else at the most" in text
    assert re.findall(r"!\[.*\]\((.*)\)", text) == ["bench_scans.png", "bench_points.png"]
    assert all((out / name).is_file() for name in ("bench_scans.png", "bench_points.png"))
    assert "(bench.md)" in (out / "README.md").read_text()
    before = {file.name: file.read_bytes() for file in out.iterdir()}
    write(tmp_path / "bench/bench.json", out, figures=True)
    assert {file.name: file.read_bytes() for file in out.iterdir()} == before


def test_without_a_benchmark_there_is_no_page(tmp_path):
    from experiments.report.bench_page import write

    assert write(tmp_path / "bench.json", tmp_path, figures=True) is None
    assert list(tmp_path.iterdir()) == []


def test_the_figures_name_the_exponents():
    from matplotlib.text import Text

    from experiments.report.bench_figures import growth_figure

    records = [r for r in everything() if r.part == "scans" and r.answer is not None]
    found = {text.get_text() for text in growth_figure(records, "scans").findobj(Text)}
    assert {"auto: exponent 1.10", "fcpma: exponent 2.20", "pairs / N"} <= found


def test_busy_machines_are_told():
    from experiments.report.bench_page import busy

    case, _ = cases(parts=["methods"])[0]
    quiet, loud = made_up(case, 0, others=0.01), made_up(case, 1, others=0.9)
    assert busy([quiet]) == ["- Besides, 0.01 cores were busy with something else at the most"]
    assert "in 1 of 2 runs more than 0.15" in busy([quiet, loud])[0]
