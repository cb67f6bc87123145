"""``mvreg look``, the first lines of a run, and names of folders that Hydra's grammar refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg.cli import main as cli
from mvreg.cli.spelling import quoted_paths
from mvreg.io import PointCloud
from mvreg.io.ply_write import write_ply_clouds


def scans(folder: Path, *, metres: bool = False) -> Path:
    for index, scan in enumerate(mvreg.dataset("tiny", views=3).scans):
        points = scan.points / (1000 if metres and index == 1 else 1)
        cloud = PointCloud(points, attributes={"intensity": points[:, 0]})
        write_ply_clouds(folder / f"{index}.ply", [cloud], {"intensity": np.dtype(float)})
    (folder / "notes.txt").write_text("on a turntable\n")
    return folder


def test_look_shows_scans_what_is_left_out_and_what_looks_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["look", str(scans(tmp_path / "a", metres=True))]) == cli.DONE
    out = capsys.readouterr().out
    (row,) = (line.split() for line in out.splitlines() if line.startswith("0.ply"))
    assert row[1].replace(",", "").isdecimal() and row[-2:] == ["unknown", "intensity"]
    assert "a: 3 scans from 3 files; " in out
    assert "remark: left out 1 file without a scan: notes.txt (" in out
    assert "1.ply spans 0.15, the median scan 15" in out and "dataset.pattern" in out
    assert "nothing looks wrong" not in out


def test_look_takes_parameters_and_other_data_sets(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(scans(tmp_path / "it's (1)"))
    assert cli.main(["look", folder, "dataset.pattern=[01].ply", "dataset.unit=mm"]) == cli.DONE
    out = capsys.readouterr().out
    assert "2 scans from 2 files" in out and "mm across" in out and "nothing looks wrong\n" in out
    assert cli.main(["look", "dataset=tiny", "dataset.views=2"]) == cli.DONE
    assert "tiny: 2 scans; " in capsys.readouterr().out
    assert cli.main(["look", "--help"]) == cli.DONE
    assert "Usage: mvreg look" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["/no/such/folder"], "error: dataset.path=/no/such/folder: expected a folder"),
        ([], "error: mvreg look: expected one folder, got none"),
        (["my", "scans"], "error: mvreg look: expected one folder, got my, scans"),
        (["."], "expected at least 2 scans"),
        ([".", "dataset.patern=x"], "did you mean pattern?"),
    ],
)
def test_what_cannot_be_looked_at_is_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    words: list[str], message: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert cli.main(["look", *words]) == cli.WRONG_INPUT
    assert message in capsys.readouterr().err


def test_a_run_says_first_what_it_read_and_at_last_what_may_be_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, run = scans(tmp_path / "a", metres=True), tmp_path / "run"
    code = cli.main(
        ["dataset=folder", f"dataset.path={folder}", "rerun=false", f"hydra.run.dir={run}"]
    )
    assert code == cli.NOT_PLACED
    shown = capsys.readouterr()
    lines = shown.err.splitlines()
    assert lines[0].startswith("read 3 scans from 3 files; ")
    assert lines[1].startswith("note: 1.ply spans 0.15, ")
    assert lines[2].startswith("note: left out 1 file without a scan: ")
    assert "\ninput: 1.ply spans 0.15, " in shown.out
    found = json.loads((run / "result.json").read_text())["input"]
    assert found["files"] == 3 and found["left_out"][0]["name"] == "notes.txt"
    assert [each["kind"] for each in found["findings"]] == ["unit"]
    assert found["scans"][0]["attributes"] == ["intensity"]


@pytest.mark.parametrize(
    "name",
    [
        "My scans", "scans (1)", "scans(1)", "vase, 2nd day", "a=b", "it's", "scans[raw]", "50%",
        "~old", "2024", "1e5", "007", "null", "true", "[x]", "{a: b}", 'a "b"', "trailing\\",
        " blanks ", "a'b\"c\\'d", "häuser", "x:y", "$5", "${x",
    ],
)  # fmt: skip
def test_a_folder_may_have_any_name(name: str) -> None:
    from mvreg.config.compose import compose

    (word,) = quoted_paths([f"dataset.path={name}"])
    if "${" in name:  # stays an interpolation
        return
    assert compose(["dataset=folder", word]).dataset.path == name


@pytest.mark.parametrize(
    "word",
    [
        "dataset.path=plain/name", "dataset.path=a\\,b", "dataset.path=${oc.env:HOME}/x",
        "seed.top_fraction=a(b", "dataset=bunny", "dataset.of=[a,b]", "-m", "dataset.path=",
        "dataset.path", "--cfg",
    ],
)  # fmt: skip
def test_other_words_stay_as_they_are(word: str) -> None:
    assert quoted_paths([word]) == [word]


def test_commas_part_the_values_of_a_sweep() -> None:
    assert quoted_paths(["-m", "dataset.path=a,b"]) == ["-m", "dataset.path=a,b"]
    assert quoted_paths(["-m", "dataset.path=a (1)"]) == ["-m", "dataset.path='a (1)'"]


@pytest.mark.parametrize(
    ("word", "spelled"),
    [("method=a(1", "\"method='a(1'\""), ("+x.y=it's", "'+x.y='"), ("method=$a(", "'method='")],
)
def test_what_cannot_be_read_is_shown_in_the_spelling_that_can(
    capsys: pytest.CaptureFixture[str], word: str, spelled: str
) -> None:
    assert cli.main([word]) == cli.WRONG_INPUT
    assert f"quote the value twice: {spelled}" in capsys.readouterr().err


def test_a_run_of_a_folder_with_an_odd_name(tmp_path: Path) -> None:
    folder = scans(tmp_path / "vase, 2nd day (it's)")
    code = cli.main([
        "dataset=folder", f"dataset.path={folder}", "rerun=false", "+method=fcpma",
        f"hydra.run.dir={tmp_path}/out (1)",
    ])  # fmt: skip
    assert code == cli.DONE
    report = json.loads((tmp_path / "out (1)/result.json").read_text())
    assert report["config"]["dataset"]["path"] == str(folder)
    assert len(report["poses"]) == 3 and np.shape(report["poses"]["0.ply"]) == (4, 4)
