"""The programs in examples/ run, and do what they say."""

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg.io import write_ply

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(program, *words, cwd, seconds=300):
    """Run an example as a reader would, warnings being errors."""
    command = [sys.executable, "-W", "error", str(EXAMPLES / program), *map(str, words)]
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, timeout=seconds
    )


def test_every_example_is_in_the_list_and_is_tested():
    listed = re.findall(r"^\| \[(\w+\.py)\]", (EXAMPLES / "README.md").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(path.name for path in EXAMPLES.glob("*.py"))
    tests = Path(__file__).read_text()
    assert all(f'"{name}"' in tests for name in listed)


def test_a_robot_gets_the_pose_of_each_scan_as_it_comes(tmp_path):
    done = run("robotics.py", "--window", 3, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert [line.split(";")[0] for line in lines[:6]] == [f"tiny_0{k}: tiny_0{k}" for k in range(6)]
    degrees, length = map(float, re.findall(r"\d+\.\d+", lines[-1]))
    assert degrees < 1.0 and length < 1.0


@pytest.fixture
def mapper(monkeypatch):
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import robotics

    return robotics.Mapper


def test_a_scan_that_fits_nothing_waits_and_is_placed_later(mapper):
    scans = mvreg.dataset("tiny").scans
    robot = mapper(window=4)
    assert set(robot.add("0", scans[0].points)) == {"0"}
    assert robot.add("5", scans[5].points) == {}  # from the other side
    placed = {}
    for number in (1, 2, 3, 4):
        placed |= robot.add(str(number), scans[number].points)
    assert set(placed) == {"1", "2", "3", "4", "5"} and not robot.waiting
    held = {name: scan.initial.copy() for name, scan in robot.placed.items()}
    robot.add("again", scans[2].moved(held["1"]).points)
    for name, pose in held.items():
        np.testing.assert_array_equal(robot.placed[name].initial, pose)


def test_a_robot_that_has_no_time_goes_on_without_the_scan(mapper):
    scans = mvreg.dataset("tiny", views=2).scans
    robot = mapper(seconds=0.0)
    robot.add("0", scans[0].points)
    assert robot.add("1", scans[1].points) == {}
    robot.seconds = 60.0
    assert set(robot.add("2", scans[1].points + 5.0)) >= {"2"}


def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    done = run("notebook.py", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("green, confidence") == 6
    assert "not placed: none" in done.stdout
    assert "<html" in (tmp_path / "registration.html").read_text()
    text = (EXAMPLES / "notebook.py").read_text()
    cells = text.split("# %%")[1:]
    assert len(cells) > 8 and sum(cell.startswith(" [markdown]") for cell in cells) >= 5


def job(inbox, name, count=3, ready=True):
    folder = inbox / name
    folder.mkdir(parents=True)
    for scan in mvreg.dataset("tiny", views=count).scans:
        write_ply(folder / f"{scan.name}.ply", scan.points)
    if ready:
        (folder / "ready").touch()
    return folder


def test_the_service_answers_every_job_that_is_ready(tmp_path):
    inbox, outbox = tmp_path / "in", tmp_path / "out"
    job(inbox, "good")
    (job(inbox, "damaged") / "tiny_01.ply").write_text("ply\nformat ascii 1.0\n")
    (job(inbox, "unwanted") / "cancel").touch()
    job(inbox, "unfinished", ready=False)
    done = run("batch_service.py", inbox, outbox, "--once", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = {file.stem: json.loads(file.read_text()) for file in outbox.glob("*.json")}
    assert set(found) == {"good", "damaged", "unwanted"}
    good = found["good"]
    assert good["status"] == "placed" and len(good["poses"]) == 3 and good["unregistered"] == []
    assert np.array(good["poses"]["tiny_00.ply"]).shape == (4, 4)
    assert {about["grade"] for about in good["grades"].values()} <= {"green", "amber"}
    assert found["damaged"]["status"] == "refused"
    assert "tiny_01.ply" in found["damaged"]["message"]
    assert found["unwanted"]["status"] == "cancelled"
    assert not list(outbox.glob("*.part"))
    before = (outbox / "good.json").stat().st_mtime_ns
    run("batch_service.py", inbox, outbox, "--once", cwd=tmp_path)
    assert (outbox / "good.json").stat().st_mtime_ns == before, "a job is done once"


def test_a_job_that_takes_too_long_says_what_was_placed(tmp_path):
    job(tmp_path / "in", "slow")
    done = run("batch_service.py", "in", "out", "--once", "--seconds", 0, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "slow.json").read_text())
    assert found["status"] == "late" and found["poses"] == {}
    assert "called off" in found["message"]


def test_the_service_watches_until_it_is_told_to_end(tmp_path):
    (tmp_path / "in").mkdir()
    command = [sys.executable, str(EXAMPLES / "batch_service.py"), "in", "out"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True) as service:
        assert service.stdout is not None
        job(tmp_path / "in", "late_comer")
        assert service.stdout.readline() == "late_comer: placed\n"
        time.sleep(0.1)
        service.send_signal(signal.SIGTERM)
        assert service.wait(timeout=30) == 0
    assert (tmp_path / "out" / "late_comer.json").is_file()
