import io
import json
import re
import subprocess
import sys

import pytest
from observed import apart, run

from mvreg.observers.console import Console, render


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def show(happened, out=None, err=None) -> tuple[str, str]:
    out, err = out or io.StringIO(), err or io.StringIO()
    console = Console(out, err)
    for event in happened:
        console.mvreg_event(event)
    console.close()
    return out.getvalue(), err.getvalue()


def line(text: str, name: str) -> str:
    return next(row for row in text.splitlines() if row.split()[:1] == [name])


def test_table_says_what_happened_to_each_scan():
    out, _ = show(run())
    grade, confidence, coverage, inlier_ratio, strength, rms = line(out, "b.ply").split()[2:8]
    assert line(out, "a.ply").split()[1] == "reference"
    assert line(out, "b.ply").split()[1] == "placed"
    assert line(out, "a.ply").split()[-2:] == line(out, "b.ply").split()[-2:] == ["0.000", "0.000"]
    # Two plates on each other, that could slide.
    assert (grade, coverage, inlier_ratio, strength) == ("RED", "1.00", "1.00", "0.00")
    assert 0 <= float(confidence.lstrip(">")) < 1 and float(rms) < 0.05
    assert "NOT PLACED" in line(out, "c.ply")
    assert "placed 2 of 3 scans with 3 pairs in 1.50 s (loading 0.50 s)" in out
    assert "c.ply was not placed: 2 attempts; the closest: trimmed MSE above Eq. (7)" in out
    assert "e_R 0.0000" in out
    assert "consistency" in out


def test_without_truth_there_is_no_word_of_errors():
    out, _ = show(run(truth=False))
    assert "error" not in out
    assert "e_R" not in out


def test_the_unit_is_named():
    millimetres, unknown = (show(run(unit=unit))[0].splitlines() for unit in ("mm", "file"))
    assert millimetres[1].split()[-3:] == ["(mm)", "(deg)", "(mm)"]
    assert unknown[1].split()[-3:] == ["(file", "error", "(file"]
    assert unknown[2].split()[-3:] == ["units)", "(deg)", "units)"]


def test_says_where_the_run_is_and_how_to_look_at_it(tmp_path):
    folder = tmp_path / "a run"
    folder.mkdir()
    assert "rerun" not in show(run(folder))[0]
    (folder / "run.rrd").touch()
    out, _ = show(run(folder))
    assert f"written to {folder}" in out
    assert f"rerun '{folder}/run.rrd'" in out


def test_where_nobody_looks_there_are_few_lines_and_no_control_characters(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    out, err = show(run())
    assert err.splitlines() == ["plates: 3 scans, grow", "prepared 3 scans, registering"]
    assert "\x1b" not in out + err
    assert "\r" not in out + err


def test_on_a_terminal_the_bar_names_the_scan_at_hand(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "120")
    shown = []
    monkeypatch.setattr(
        "rich.progress.Progress.update",
        lambda self, task, description, completed: shown.append((description, completed)),
    )
    out, err = show(run(), Terminal(), Terminal())
    assert ("preparing b.ply", 1) in shown
    assert any("b.ply -> a.ply" in text and done == 1 for text, done in shown)
    assert any("c.ply -> a.ply" in text and done == 2 for text, done in shown)
    assert ("adjusting the poses of", 2) in shown
    assert "\x1b" in err
    assert "prepared 3 scans" not in err
    assert "NOT PLACED" in out


def test_runs_side_by_side_share_a_terminal(monkeypatch):
    class Counting(Terminal):
        writes = 0

        def write(self, text: str) -> int:
            self.writes += 1
            return super().write(text)

    monkeypatch.setattr("mvreg.observers.console.parent_process", lambda: object())
    terminal = Counting()
    out, err = show(run(), terminal, Terminal())
    assert err == "plates: 3 scans, grow\nprepared 3 scans, registering\n"
    assert terminal.writes == 1, "or other runs' lines would come between"
    assert "placed 2 of 3" in out and "\x1b" not in out


def test_the_bar_goes_away_when_a_run_breaks_off(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    err = Terminal()
    console = Console(io.StringIO(), err)
    for event in run()[:6]:
        console.mvreg_event(event)
    console.close()
    console.close()
    assert err.getvalue().count("\x1b[?25l") == err.getvalue().count("\x1b[?25h") == 1


def test_names_are_not_markup():
    text = json.dumps(run()[-1].report).replace("b.ply", "[red]b[/x].ply")
    out = io.StringIO()
    render(json.loads(text), file=out)
    assert "[red]b[/x].ply" in out.getvalue()


def test_a_report_read_back_shows_the_same():
    happened = run()
    out = io.StringIO()
    render(json.loads(json.dumps(happened[-1].report)), file=out)
    assert out.getvalue() == show(happened)[0]


def test_an_interrupted_report_says_so():
    out = io.StringIO()
    render({**run()[-1].report, "status": "interrupted"}, file=out)
    assert "interrupted" in out.getvalue()


def test_errors_in_another_frame_say_which():
    report = run()[-1].report
    out = io.StringIO()
    render({**report, "errors": {**report["errors"], "frame": "b.ply"}}, file=out)
    assert "in the frame of b.ply" in out.getvalue()


@pytest.mark.parametrize(
    "key",
    ["seconds", "errors", "consistency", "scans", "poses", "unit", "components", "grades", "links"],
)
def test_a_report_with_gaps_is_still_shown(key):
    out = io.StringIO()
    render({k: v for k, v in run()[-1].report.items() if k != key}, file=out)
    assert "placed" in out.getvalue()


def test_observers_wait_with_what_is_slow_to_import():
    code = (
        "import sys, mvreg.observers.console, mvreg.observers.recorder, mvreg.observers.rerun\n"
        "sys.exit(str(sorted({'rich', 'rerun', 'open3d', 'scipy'} & set(sys.modules)) or ''))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip() == ""


def test_partial_models_have_tables_of_their_own_below_the_first():
    out, _ = show(apart())
    lines = out.splitlines()
    heading = lines.index("component 2: 2 scans, in the frame of d.ply")
    rows = {name: out.index(f"\n{name}") for name in ("b.ply", "s.ply", "d.ply", "e.ply")}
    place = out.index(lines[heading])
    assert rows["b.ply"] < rows["s.ply"] < place < rows["d.ply"] < rows["e.ply"]
    assert line(out, "s.ply").split()[1] == "AMBIGUOUS"
    assert line(out, "e.ply").split()[1] == "apart"
    assert line(out, "e.ply").split()[-1] == "0.500"
    first, second = (row for row in lines if row.startswith("scan "))
    assert first.index("covered") == second.index("covered")
    assert "placed 2 of 6 scans (2 more in 1 other component) with 5 pairs" in out
    assert "component 2: e_R 0.0000 (max 0.0000), e_t 0.250 mm (max 0.500 mm)\n" in out
    assert (
        "component 2 was not joined to the first: 2 attempts; the closest (confidence 0.40): too"
        in out
    )
    assert "s.ply was not placed: 1 attempt; the closest (confidence 0.80): ambiguous: " in out
    assert (
        "x.ply was not placed: 1 attempt; the closest (confidence 0.91): accepted at first" in out
    )


def test_colours_are_explained_and_words_stand_for_them():
    out, _ = show(apart())
    assert (
        "green: confidence 0.95, coverage 0.34, inlier ratio 0.80, weakest axis 0.10 or more" in out
    )
    assert "RED: confidence below 0.50" in out
    assert "share of these within 0.500 mm of" in out
    assert "b.ply is RED: ambiguous" in out


def coloured(grade: str, confidence: float) -> str:
    """The row of a scan of that grade, as a terminal gets it."""
    report = json.loads(json.dumps(run()[-1].report))
    report["scans"][1]["assessment"] |= {"grade": grade, "confidence": confidence}
    out = Terminal()
    render(report, file=out)
    return next(row for row in out.getvalue().splitlines() if "b.ply" in row)


def test_grades_are_coloured(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    shown = {grade: coloured(grade, 0.9987) for grade in ("green", "amber", "red")}
    colours = {grade: re.findall(r"\x1b\[([\d;]+)m *(green|amber|RED)", row)
               for grade, row in shown.items()}  # fmt: skip
    assert colours == {
        "green": [("32", "green")], "amber": [("33", "amber")], "red": [("1;31", "RED")],
    }  # fmt: skip
    assert ">0.99" in shown["green"], "no confidence is told as certainty"
    assert "0.98" in coloured("green", 0.98)


@pytest.mark.parametrize("events", [run, apart])
def test_the_table_fits_in_100_columns(events):
    out, _ = show(events())
    report = json.dumps(events()[-1].report).replace("b.ply", "dragonStandRight_120.ply")
    long = io.StringIO()
    render(json.loads(report), file=long)
    for text in (out, long.getvalue()):
        table, _, _ = text.partition("\nplaced ")
        assert max(map(len, table.splitlines())) <= 100


def test_a_report_from_before_scans_were_assessed_is_shown():
    report = json.loads(json.dumps(run()[-1].report))
    for row in report["scans"]:
        del row["assessment"], row["component"]
    del report["grades"], report["components"], report["links"]
    out = io.StringIO()
    render(report, file=out)
    assert line(out.getvalue(), "a.ply").split()[1:] == ["reference", "-", "-", "0.000", "0.000"]
    assert line(out.getvalue(), "b.ply").split()[1:4] == ["placed", "0.80", "0.500"]
    assert "RED" not in out.getvalue()


def test_the_bar_follows_poses_that_are_revised(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    shown = []
    monkeypatch.setattr(
        "rich.progress.Progress.update",
        lambda self, task, description, completed: shown.append((description, completed)),
    )
    show(apart(), Terminal(), Terminal())
    assert ("joined into one model:", 2) in shown
    assert ("2 scans in 1 other part, joined to the first:", 2) in shown
