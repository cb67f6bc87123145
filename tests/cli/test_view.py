"""`mvreg view` and `mvreg.show`: look at a run with what is there."""

from __future__ import annotations

import subprocess
import webbrowser

import numpy as np
import pytest

import mvreg
from mvreg.cli import main as cli
from mvreg.cli import view_run
from mvreg.errors import InputError


def test_the_page_is_opened_in_a_browser(tmp_path, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url) or True)
    (tmp_path / "report.html").touch()
    assert cli.main(["view", str(tmp_path)]) == 0
    assert opened == [(tmp_path / "report.html").as_uri()]
    assert capsys.readouterr().out == f"{tmp_path / 'report.html'}\n"


def test_else_the_recording_in_rerun(tmp_path, monkeypatch):
    started = []
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    monkeypatch.setattr(subprocess, "Popen", lambda words, **_: started.append(words))
    monkeypatch.setattr(view_run, "rerun", lambda: "rerun")
    for name in ("report.html", "run.rrd"):
        (tmp_path / name).touch()
    assert cli.main(["view", str(tmp_path)]) == 0
    assert cli.main(["view", "--rerun", str(tmp_path)]) == 0
    assert started == [["rerun", str(tmp_path / "run.rrd")]] * 2


def test_where_nothing_can_show_it_that_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    monkeypatch.setattr(view_run, "rerun", lambda: None)
    assert cli.main(["view", str(tmp_path)]) == 2
    assert "found neither" in capsys.readouterr().err
    (tmp_path / "report.html").touch()
    assert cli.main(["view", str(tmp_path)]) == 2
    assert "no browser could be started: open" in capsys.readouterr().err
    assert cli.main(["view", "--rerun", str(tmp_path)]) == 2
    assert "has no run.rrd" in capsys.readouterr().err


def test_a_result_is_shown_in_a_notebook():
    scans = mvreg.dataset("tiny", views=3)
    result = mvreg.register(scans)
    for found in (mvreg.show(result), mvreg.show(result, scans, height=500)):
        assert "All 3 scans are placed in one model." in found.html
        frame = found._repr_html_()
        assert frame.startswith('<iframe srcdoc="&lt;!DOCTYPE html&gt;') and frame.count('"') == 6
        assert len(repr(found)) < 100
    assert "height: 500px" in frame


def test_a_result_without_views_is_refused():
    with pytest.raises(InputError, match="expected a result with its views"):
        mvreg.show(mvreg.Result("a", {"a": np.eye(4)}, (), ()))
