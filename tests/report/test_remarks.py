"""What was done to the scans, and who told where their sensors were, is in the report and shown."""

import io
import json
from pathlib import Path

import numpy as np

from mvreg.cli import main as cli
from mvreg.report.json_file import load_report
from mvreg.report.summary import totals
from mvreg.report.table import render

PCD = (
    "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\n"
    "VIEWPOINT {at} 1 0 0 0\nPOINTS {n}\nDATA ascii\n"
)


def leave(folder: Path) -> None:
    """Two scans: one tells its sensor, the other has three pixels without a return."""
    points = np.random.default_rng(0).normal(size=(40, 3))
    for name, at, zeros in (("a", "0 0 9", 0), ("b", "0 0 0", 3)):
        rows = np.vstack([points, np.zeros((zeros, 3))])
        text = "\n".join(" ".join(map(repr, row)) for row in rows.tolist())
        (folder / f"{name}.pcd").write_text(PCD.format(n=len(rows), at=at) + text + "\n")


def shown(report: dict) -> list[str]:
    out = io.StringIO()
    render(report, None, out)
    return out.getvalue().splitlines()


def test_inspect_shows_remarks_and_sensors(tmp_path, capsys):
    leave(tmp_path)
    run = tmp_path / "run"
    code = cli.main(["dataset=folder", f"dataset.path={tmp_path}", "rerun=false", "+method=fcpma",
                     f"hydra.run.dir={run}"])  # fmt: skip
    assert code in (cli.DONE, cli.NOT_PLACED)
    report = json.loads((run / "result.json").read_text())
    assert {row["name"]: row["sensor"] for row in report["scans"]} == {
        "a.pcd": "file", "b.pcd": "unknown",
    }  # fmt: skip
    (remark,) = report["remarks"]
    assert remark.startswith("dropped 3 points")
    at_the_end = capsys.readouterr().out
    assert cli.main(["inspect", str(run)]) == cli.DONE
    for text in (at_the_end, capsys.readouterr().out):
        assert text.count(f"remark: {remark}\n") == 1
        assert text.count("sensor told by the file for 1 scan, unknown for 1 scan\n") == 1


def test_where_the_data_set_knows_it_all_nothing_is_said():
    report = {"scans": [{"name": "a", "sensor": "data set"}, {"name": "b", "sensor": "data set"}]}
    assert not [line for line in shown(report) if "sensor" in line or "remark" in line]
    report["scans"][0]["sensor"] = "user"
    assert "sensor told by dataset.sensor for 1 scan, told by the data set for 1 scan" in (
        shown(report)
    )


def test_a_report_from_before_is_shown_without():
    old = load_report(Path(__file__).with_name("schema_2.json"))
    assert not [line for line in map(str, totals(old)) if "sensor" in line or "remark" in line]
