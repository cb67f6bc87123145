import io
import json
import subprocess
import sys

import pytest
from observed import run

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
    assert line(out, "a.ply").split()[1:] == ["reference", "-", "-", "0.000", "0.000"]
    assert line(out, "b.ply").split()[1:4] == ["placed", "0.80", "0.500"]
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
    assert "trimmed RMSE (mm)" in show(run())[0]
    assert "trimmed RMSE (file units)" in show(run(unit="file"))[0]


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
    assert any("b.ply -> model" in text and done == 1 for text, done in shown)
    assert any("c.ply -> model" in text and done == 2 for text, done in shown)
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


@pytest.mark.parametrize("key", ["seconds", "errors", "consistency", "scans", "poses", "unit"])
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
