"""A full disk: what matters is written first, and the message says what was saved."""

import numpy as np
import pytest
from observed import run as recorded

from mvreg.errors import InputError
from mvreg.library import dataset
from mvreg.observers.rerun.observer import RerunObserver
from mvreg.report import finished
from mvreg.report.json_file import load_report
from mvreg.types import Result


@pytest.fixture
def placed():
    scanset = dataset("tiny", views=3, points=500)
    poses = {scan.name: np.eye(4) for scan in scanset.scans}
    return scanset, Result(scanset.scans[0].name, poses, (), ())


def full(*args):
    raise OSError(28, "No space left on device")


REPORT = {"schema": 3, "status": "complete"}


def test_without_room_for_the_model_poses_and_report_are_there(tmp_path, placed, monkeypatch):
    monkeypatch.setattr(finished, "write_models", full)
    with pytest.raises(InputError) as caught:
        finished.write_run(tmp_path, *placed, REPORT)
    message = str(caught.value)
    assert "model.ply: No space left on device" in message
    assert "saved in" in message and "result.json, the poses, pairs.csv" in message
    assert f"mvreg export {tmp_path} ply" in message
    assert load_report(tmp_path)["status"] == "complete"
    assert len(list((tmp_path / "poses").glob("*.txt"))) == 3


def test_what_is_worth_less_is_given_up_for_the_model(tmp_path, placed, monkeypatch):
    recording = tmp_path / "run.rrd"
    recording.write_bytes(b"pictures")
    write = finished.write_models

    def write_if_there_is_room(*args):
        if recording.exists():
            full()
        write(*args)

    def make_room():
        recording.unlink()
        return True

    monkeypatch.setattr(finished, "write_models", write_if_there_is_room)
    finished.write_run(tmp_path, *placed, REPORT, make_room)
    assert (tmp_path / "model.ply").stat().st_size > 1000
    assert load_report(tmp_path)["status"] == "complete"


def test_a_recording_that_is_given_up_leaves_no_file(tmp_path):
    observer = RerunObserver(tmp_path / "run.rrd")
    assert not observer.give_up(), "there is none yet"
    for event in recorded()[:4]:
        observer.mvreg_event(event)
    observer._thread.submit(lambda: None).result()  # until these are recorded
    assert observer.give_up()
    assert not (tmp_path / "run.rrd").exists()
    observer.mvreg_event(recorded()[-1])
    observer.close()
    assert not (tmp_path / "run.rrd").exists(), "what comes after is not recorded"


def test_without_room_for_the_report_nothing_half_written_is_left(tmp_path, placed, monkeypatch):
    monkeypatch.setattr(finished, "write_part", full)
    with pytest.raises(InputError, match=r"saved in .*: pairs\.csv"):
        finished.write_run(tmp_path, *placed, REPORT)
    assert not list(tmp_path.iterdir())


def test_the_report_appears_last(tmp_path, placed, monkeypatch):
    seen = []
    write = finished.write_models
    monkeypatch.setattr(
        finished,
        "write_models",
        lambda *args: (seen.append((tmp_path / "result.json").exists()), write(*args)),
    )
    finished.write_run(tmp_path, *placed, REPORT)
    assert seen == [False] and (tmp_path / "result.json").exists()
