"""Runs compared: what is put together, what is marked, and how it is written."""

from __future__ import annotations

import csv
import io
import json
import sys
from html.parser import HTMLParser

import pytest

import mvreg
from mvreg.cli import main as cli
from mvreg.errors import InputError, MvregError
from mvreg.report.comparison.formats import as_csv, as_html, as_latex, as_markdown
from mvreg.report.comparison.runs import find
from mvreg.report.comparison.table import QUANTITIES, tabled
from mvreg.report.upgrade import SCHEMA


def keep(folder, words=(), *, placed=3, angle=0.1, seconds=1.0, method="auto", config=None):
    """A finished run, as far as it is compared."""
    (folder / ".hydra").mkdir(parents=True)
    if config is None:
        (folder / ".hydra" / "overrides.yaml").write_text(json.dumps(list(words)))
    else:
        (folder / ".hydra").rmdir()
    names = [f"scan{k}" for k in range(3)]
    errors = {n: {"angle_deg": angle, "rotation": angle, "translation": 1.0} for n in names}
    report = {
        "schema": SCHEMA, "dataset": "a_b", "method": method, "unit": "mm", "num_pairs": 4,
        "scans": [{"name": n} for n in names], "poses": dict.fromkeys(names[:placed]),
        "errors": {"mean": {"rotation": angle, "translation": 1.0}, "scans": errors},
        "consistency": {"rms": 0.5}, "seconds": {"total": seconds}, "config": config or {},
    }  # fmt: skip
    (folder / "result.json").write_text(json.dumps(report))
    return folder


@pytest.fixture
def root(tmp_path):
    words = ["dataset=a_b", "rerun=false"]
    for rng, seconds in enumerate((1.0, 3.0, 2.0)):
        keep(tmp_path / f"r{rng}", [*words, f"rng={rng}"], seconds=seconds)
    keep(tmp_path / "x", [*words, "refine=icp"], angle=0.05, seconds=5.0)
    keep(tmp_path / "y", [*words, "+method=quick"], placed=2, seconds=0.1, method="quick")
    (tmp_path / "latest").symlink_to("x", target_is_directory=True)
    return tmp_path


def cell(row, name):
    return row.cells[[one.name for one in QUANTITIES].index(name)]


def test_runs_that_repeat_each_other_are_one_row(root):
    table = tabled(find([root]))
    assert table.columns == ("data set", "method", "refine")
    assert [row.named for row in table.rows] == [
        ("a_b", "auto", ""), ("a_b", "auto", "icp"), ("a_b", "quick", ""),
    ]  # fmt: skip
    first = table.rows[0]
    assert len(first.runs) == 3
    time = cell(first, "time")
    assert time.ends == (2.0, 1.0, 3.0)
    assert len(find([root, root / "r0", str(root / "r*")])) == 5


def test_the_best_places_most_before_it_is_fast(root):
    auto, icp, quick = tabled(find([root])).rows
    assert cell(auto, "placed").best and not cell(quick, "placed").best
    assert cell(auto, "time").best and not cell(quick, "time").best
    assert cell(icp, "e_R").best and not cell(auto, "e_R").best


def test_false_placements_count_against_a_row(root):
    keep(root / "z", ["rng=0", "judge=none"], angle=50.0, seconds=0.01)
    row = next(row for row in tabled(find([root])).rows if "none" in row.named)
    assert cell(row, "false").median == 3
    assert not cell(row, "false").best and not cell(row, "time").best


def test_without_what_was_said_parameters_tell_runs_apart(tmp_path):
    for k, value in enumerate((0.1, 0.2)):
        keep(tmp_path / str(k), config={"seed": {"top": value, "same": 1}, "rng": k})
    assert tabled(find([tmp_path])).columns == ("data set", "method", "seed.top")


def test_it_is_written_in_every_format(root):
    table = tabled(find([root]))
    rows = list(csv.DictReader(io.StringIO(as_csv(table))))
    assert [float(row["time"]) for row in rows] == [2.0, 5.0, 0.1]
    assert (rows[0]["time_min"], rows[0]["time_max"], rows[0]["runs"]) == ("1.0", "3.0", "3")
    lines = as_markdown(table).splitlines()
    assert (
        len({line.count("|") for line in lines[:5]}) == 1 and "**2.00 (1.00 to 3.00)**" in lines[2]
    )
    tex = as_latex(table)
    assert r"a\_b" in tex and r"\textbf{3/3}" in tex and tex.count(r"\\") == 4
    page = as_html(table)
    assert "http" not in page and page.count("<svg") == 6  # nothing is placed falsely
    parser = HTMLParser()
    parser.feed(page)


def test_the_command_line(root, tmp_path, capsys):
    assert cli.main(["compare", str(root)]) == 0
    assert "2.00 (1.00 to 3.00) *" in capsys.readouterr().out
    for name, begin in (("t.csv", "data set,"), ("t.md", "| data"), ("t.html", "<!DOCTYPE")):
        assert cli.main(["compare", str(root), "--out", str(tmp_path / name)]) == 0
        assert (tmp_path / name).read_text().startswith(begin)
    capsys.readouterr()
    assert cli.main(["compare", str(root), "--format", "latex"]) == 0
    assert r"\begin{tabular}" in capsys.readouterr().out
    assert cli.main(["compare", str(root), "--out", "t.doc"]) == 2
    assert "expected a name that ends in .csv" in capsys.readouterr().err
    assert cli.main(["compare", str(tmp_path / "none")]) == 2
    assert "found no result.json there" in capsys.readouterr().err
    assert cli.main(["compare", str(root), "--out", str(tmp_path / "no" / "t.md")]) == 2


def test_a_data_frame(root):
    pytest.importorskip("pandas")
    frame = mvreg.compare(root)
    assert list(frame["runs"]) == [3, 1, 1] and list(frame["time_max"]) == [3.0, 5.0, 0.1]
    every = mvreg.compare(root, grouped=False)
    assert len(every) == 5 and set(every["method"]) == {"auto", "quick"}


def test_without_pandas_it_says_what_to_install(root, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MvregError, match=r"mvreg\[tables\]"):
        mvreg.compare(root)


def test_a_broken_run_is_named(root):
    (root / "x" / "result.json").write_text("{")
    with pytest.raises(InputError, match="cut short"):
        find([root])
