"""The page of a run under way, and the time left on the screen."""

from __future__ import annotations

import io
import re
import time

from observed import run

from mvreg import events
from mvreg.observers import pace
from mvreg.observers.console import Console
from mvreg.observers.pace import Pace
from mvreg.observers.recorder import Recorder


def until_placed(folder):
    happened = run(folder)
    placed = next(k for k, e in enumerate(happened) if isinstance(e, events.ViewPlaced))
    return happened[: placed + 1]


def feed(recorder, happened):
    for event in happened:
        recorder.mvreg_event(event)
    return recorder


def test_a_page_is_written_while_a_long_run_is_under_way(tmp_path, monkeypatch):
    monkeypatch.setattr(pace, "EVERY", 0.0)
    monkeypatch.setattr(pace, "SUPPOSED", 0.0)
    recorder = feed(Recorder(tmp_path / "now", page=True), until_placed(tmp_path / "now"))
    page = (tmp_path / "now" / "report.html").read_text(encoding="utf-8")
    assert "Under way: 2 of 3 scans are placed in one model so far" in page
    assert "load this page again" in page and "nothing is left to do" not in page
    assert "not judged yet" in page and "Not placed</h2>" not in page
    assert not (tmp_path / "now" / "result.json").exists()
    recorder.finish_interrupted(rng=3, config={})
    page = (tmp_path / "now" / "report.html").read_text(encoding="utf-8")
    assert "Interrupted: 2 of 3 scans were placed so far" in page


def test_a_short_run_writes_none_before_its_end(tmp_path):
    feed(Recorder(tmp_path / "now", page=True), until_placed(tmp_path / "now")).close()
    assert not (tmp_path / "now" / "report.html").exists()


def test_pages_come_every_minute_and_take_a_twentieth_of_the_time_at_most(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    small, usual, large = Pace(10), Pace(300), Pace(900)
    now[0] = 59.0
    assert not small.due() and not usual.due()
    now[0] = 61.0
    assert small.due() and usual.due() and not large.due()
    now[0] = 66.0
    small.written(61.0)  # it took 5 s
    usual.written(65.0)
    now[0] = 127.0
    assert not small.due() and usual.due()
    now[0] = 167.0
    assert small.due()


def test_the_time_left_is_told_once_it_is_known(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "160")
    terminal = Terminal()
    console = Console(io.StringIO(), terminal)
    for event in until_placed(None):
        console.mvreg_event(event)
        time.sleep(0.02)
    console._bar.refresh()
    time.sleep(0.6)
    console._bar.refresh()
    console.close()
    assert re.search(r"about 0:00:0\d left", terminal.getvalue())
