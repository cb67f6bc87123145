"""Whole runs through the command line, in a process of their own, and the folders they leave."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from small_scans import OVERRIDES, placed_like, three, write_folder

from mvreg.cli import job
from mvreg.config.overrides import spelled
from mvreg.io import read_points
from mvreg.library import dataset
from mvreg.types import Result

FILES = {".hydra", "model.ply", "pairs.csv", "poses", "result.json", "report.html", "run.rrd"}
COLUMNS = [
    "source", "target", "overlap", "trimmed_mse", "threshold", "verdict", "reason", "seconds",
    "score", "confidence",
]  # fmt: skip
KEYS = {
    "schema", "method", "dataset", "rng", "unit", "reference", "poses", "unregistered",
    "num_pairs", "seconds", "errors", "consistency", "config", "versions", "components", "grades",
    "links", "pairs",
}  # fmt: skip


def command(*words):
    return [sys.executable, "-m", "mvreg", "+method=fcpma", *OVERRIDES, *words]


def mvreg(*words, cwd):
    return subprocess.run(
        command(*words), cwd=cwd, capture_output=True, text=True, timeout=300, check=False
    )


def report_of(folder):
    return json.loads((folder / "result.json").read_text())


def rows_of(folder):
    with (folder / "pairs.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def scans(tmp_path_factory) -> Path:
    """Three scans of the blob as files, and a fourth that nothing can be made of."""
    return write_folder(tmp_path_factory.mktemp("scans") / "Müller's scans", three(), poor=True)


@pytest.fixture(scope="module")
def run(scans, tmp_path_factory):
    """A run on a folder of scans; with a recording."""
    cwd = tmp_path_factory.mktemp("run")
    done = mvreg("dataset=folder", f"dataset.path={spelled(scans)}", cwd=cwd)
    return done, cwd / "runs" / "folder" / "fcpma" / "latest"


def test_without_rerun_there_is_no_recording_and_a_warning(tmp_path, monkeypatch):
    monkeypatch.setattr(job, "find_spec", lambda name: None)
    with pytest.warns(UserWarning, match=r"pip install rerun-sdk.*rerun=false"):
        assert job.recordings(tmp_path) == []


def test_what_cannot_be_placed_gives_exit_code_3_and_is_named(run):
    done, folder = run
    assert done.returncode == 3, done.stderr
    assert report_of(folder)["unregistered"] == ["poor.ply"]
    assert report_of(folder)["status"] == "incomplete"
    assert "poor.ply" in done.stdout
    assert "NOT PLACED" in done.stdout
    assert "Traceback" not in done.stderr
    assert not (folder / "poses" / "poor.txt").exists()


def test_the_run_folder_has_what_it_should(run):
    _, folder = run
    assert {file.name for file in folder.iterdir()} == FILES
    assert folder.is_symlink()
    assert (folder / ".hydra" / "config.yaml").is_file()
    assert sorted(file.name for file in (folder / "poses").iterdir()) == [
        "blob_0.txt", "blob_1.txt", "blob_2.txt",
    ]  # fmt: skip
    assert (folder / "run.rrd").stat().st_size > 10_000
    assert not list(folder.rglob("*.part")), "nothing half-written"


def test_the_report_is_complete(run):
    _, folder = run
    report = report_of(folder)
    assert set(report) >= KEYS
    assert (report["schema"], report["method"]) == (3, "fcpma")
    assert (report["dataset"], report["unit"]) == ("Müller's scans", "file")
    assert report["errors"] is None, "there is no ground truth"
    assert report["consistency"]["rms"] > 0
    assert report["reference"] == "blob_0.ply"
    stages = {"downsample", "describe", "seed", "propagate", "refine", "judge", "augment", "adjust"}
    assert set(report["seconds"]) >= stages | {"load", "total"}
    assert sum(report["seconds"][stage] for stage in stages) <= report["seconds"]["total"]
    assert report["config"]["downsample"]["stride"] == 2
    assert {"mvreg", "python", "numpy", "scipy"} <= set(report["versions"])
    assert [row["name"] for row in report["scans"]] == [
        "blob_0.ply", "blob_1.ply", "blob_2.ply", "poor.ply",
    ]  # fmt: skip


def test_poses_model_and_pairs_agree_with_the_report(run, scans):
    _, folder = run
    report = report_of(folder)
    points = []
    for name, pose in report["poses"].items():
        file = folder / "poses" / name.replace(".ply", ".txt")
        np.testing.assert_array_equal(np.loadtxt(file), pose, "to the last bit")
        points.append(read_points(scans / name) @ np.array(pose)[:3, :3].T + np.array(pose)[:3, 3])
    np.testing.assert_allclose(read_points(folder / "model.ply"), np.concatenate(points), atol=1e-3)
    rows = rows_of(folder)
    assert list(rows[0]) == COLUMNS
    assert len(rows) == report["num_pairs"]
    accepted = [row["source"] for row in rows if row["verdict"] == "accepted"]
    assert accepted == [name for name in report["poses"] if name != report["reference"]]
    hopeless = [row for row in rows if row["source"] == "poor.ply"]
    assert hopeless
    assert all(row["reason"] == "no candidate pose" for row in hopeless)
    assert all(float(row["seconds"]) >= 0 for row in rows)


def test_the_poses_are_right_without_a_view_direction(run):
    """Files in a folder do not know their sensor."""
    report = report_of(run[1])
    names = {scan.name: f"{scan.name}.ply" for scan in three().scans}
    poses = {name: np.array(report["poses"][file]) for name, file in names.items()}
    found = Result("blob_0", poses, (), ())
    assert placed_like(found, three(), three().poses) < 3.0


def test_the_same_command_gives_the_same_poses_bit_for_bit(run, scans):
    _, folder = run
    again = mvreg("dataset=folder", "dataset.path=.", "rerun=false", cwd=scans)
    assert again.returncode == 3, again.stderr
    other = report_of(scans / "runs" / "folder" / "fcpma" / "latest")
    assert other["poses"] == report_of(folder)["poses"]
    assert {file.name for file in (scans / "runs/folder/fcpma/latest").iterdir()} == (
        FILES - {"run.rrd"}
    )


def test_tiny_is_registered_with_exit_code_0(tmp_path):
    """The embedded data set from its name to its errors, which are known."""
    words = ["dataset=tiny", "downsample.keypoint_ratio=20", "rerun=false", "rng=3"]
    done = mvreg(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    report = report_of(tmp_path / "runs" / "tiny" / "fcpma" / "latest")
    assert (report["status"], report["unregistered"], report["rng"]) == ("complete", [], 3)
    assert (report["dataset"], report["unit"], len(report["poses"])) == ("tiny", "mm", 6)
    errors = report["errors"]
    assert errors["mean"]["rotation"] < 0.03
    assert errors["mean"]["translation"] < 2.5
    assert errors["max"]["angle_deg"] < 3
    assert set(errors["scans"]) == {scan.name for scan in dataset("tiny").scans}
    assert f"{errors['mean']['rotation']:.4f}" in done.stdout
    assert "placed 6 of 6 scans" in done.stdout


def interrupted(words, cwd, after_rows):
    """Start a run, press Ctrl-C when so many pairs are recorded, and return how it ended."""
    with subprocess.Popen(
        command(*words), cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        # A shell's background job ignores Ctrl-C, and hands that down to this test and its child.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as child:  # fmt: skip
        try:
            deadline = time.monotonic() + 120
            while time.monotonic() < deadline and child.poll() is None:
                tables = list(cwd.glob("runs/folder/fcpma/2*/pairs.csv"))
                if tables and tables[0].read_text().count("\n") > after_rows:
                    break
                time.sleep(0.05)
            os.kill(child.pid, signal.SIGINT)
            out, err = child.communicate(timeout=60)
        finally:
            child.kill()
    (folder,) = cwd.glob("runs/folder/fcpma/2*")
    return child.returncode, out, err, folder


@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is sent as a POSIX signal")
def test_ctrl_c_leaves_what_was_finished(scans, tmp_path):
    slow = ["dataset=folder", f"dataset.path={tmp_path / 'many'}", "propagate.samples=2000"]
    write_folder(tmp_path / "many", three(), poor=False)
    for index in range(12):  # copies take as long as originals
        file = tmp_path / "many" / f"copy_{index}.ply"
        file.write_bytes((scans / f"blob_{index % 3}.ply").read_bytes())
    code, out, err, folder = interrupted([*slow, "rerun=false"], tmp_path, after_rows=2)
    assert code == 130, out + err
    assert "interrupted" in err
    assert "Traceback" not in err
    report, rows = report_of(folder), rows_of(folder)
    assert report["status"] == "interrupted"
    assert report["num_pairs"] == len(rows)
    assert 2 <= len(rows) < 15
    accepted = [row["source"] for row in rows if row["verdict"] == "accepted"]
    placed = list(report["poses"])[1:]
    assert placed == accepted[: len(placed)]
    assert len(accepted) - len(placed) <= 1, "accepted, and not merged in yet"
    assert len(report["poses"]) + len(report["unregistered"]) == 15
    assert len(list((folder / "poses").iterdir())) == len(report["poses"])
    assert (folder / "model.ply").is_file()
    assert "Interrupted: " in (folder / "report.html").read_text(encoding="utf-8")


def test_wrong_input_leaves_one_line_and_exit_code_2(tmp_path):
    done = mvreg("dataset=folder", "dataset.path=nowhere", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("error: dataset.path=nowhere: expected a folder")
    assert "Traceback" not in done.stderr
