import csv
import io
import json

import numpy as np
import pluggy
import pytest
from observed import run

from mvreg import events, hookspecs
from mvreg.errors import InputError
from mvreg.io import read_points
from mvreg.observers.console import Console
from mvreg.observers.files import link_latest, pose_files
from mvreg.observers.recorder import Recorder
from mvreg.observers.rerun import RerunObserver


def record(folder, happened, **options) -> Recorder:
    recorder = Recorder(folder, **options)
    for event in happened:
        recorder.mvreg_event(event)
    return recorder


def rows(folder) -> list[dict[str, str]]:
    with (folder / "pairs.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_finished_run_leaves_everything(tmp_path):
    folder = tmp_path / "plates" / "grow" / "now"
    happened = run()
    record(folder, happened)
    assert json.loads((folder / "result.json").read_text()) == happened[-1].report
    names = sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    assert names == ["model.ply", "pairs.csv", "poses/a.txt", "poses/b.txt", "result.json"]


def test_pairs_are_rows(tmp_path):
    record(tmp_path / "now", run())
    hopeless, accepted, rejected = rows(tmp_path / "now")
    assert list(accepted)[:8] == [
        "source", "target", "overlap", "trimmed_mse", "threshold", "verdict", "reason", "seconds",
    ]  # fmt: skip
    assert (accepted["source"], accepted["target"]) == ("b.ply", "model")
    assert [r["verdict"] for r in (hopeless, accepted, rejected)] == [
        "rejected",
        "accepted",
        "rejected",
    ]
    assert float(accepted["overlap"]) == 0.8
    assert float(accepted["seconds"]) == 0.75
    assert float(rejected["trimmed_mse"]) > float(rejected["threshold"])
    assert (hopeless["overlap"], hopeless["threshold"]) == ("", "")
    assert hopeless["reason"] == "no candidate pose"


def test_rows_are_there_while_the_run_goes_on(tmp_path):
    happened = run()
    until = next(k for k, e in enumerate(happened) if isinstance(e, events.PairRegistered))
    recorder = record(tmp_path / "now", happened[: until + 1])
    assert len(rows(tmp_path / "now")) == 1
    recorder.close()


def test_poses_come_back_bit_for_bit(tmp_path):
    happened = run()
    pose = happened[-1].result.poses["b.ply"]
    pose[0, 3] = 1 / 3
    record(tmp_path / "now", happened)
    assert (np.loadtxt(tmp_path / "now" / "poses" / "b.txt") == pose).all()


def test_the_model_is_all_points_of_the_placed_scans(tmp_path):
    happened = run()
    record(tmp_path / "now", happened)
    points = read_points(tmp_path / "now" / "model.ply")
    a, b, _ = happened[0].scanset.scans
    expected = np.concatenate([a.points, b.points + np.array([2.0, 0, 0])])
    np.testing.assert_allclose(points, expected, atol=1e-5)


def test_an_interrupted_run_keeps_what_was_finished(tmp_path):
    happened = run()
    placed = next(k for k, e in enumerate(happened) if isinstance(e, events.ViewPlaced))
    recorder = record(tmp_path / "now", happened[: placed + 1])
    file = recorder.finish_interrupted(rng=3, config={"x": 1})
    report = json.loads(file.read_text())
    assert report["status"] == "interrupted"
    assert set(report["poses"]) == {"a.ply", "b.ply"}
    assert report["unregistered"] == ["c.ply"]
    assert report["num_pairs"] == 2
    assert report["seconds"]["augment"] == 0.125
    assert report["config"] == {"x": 1}
    assert report["errors"]["mean"]["rotation"] == 0
    assert (tmp_path / "now" / "model.ply").exists()


@pytest.mark.parametrize("count", [0, 1, 3])
def test_interrupted_before_there_was_any_pose(tmp_path, count):
    recorder = record(tmp_path / "now", run()[:count])
    assert recorder.finish_interrupted(rng=3, config={}) is None
    assert not (tmp_path / "now" / "result.json").exists()


def test_an_old_answer_does_not_survive_a_run_cut_short(tmp_path):
    record(tmp_path / "now", run())
    record(tmp_path / "now", run()[:1]).close()
    assert not (tmp_path / "now" / "result.json").exists()
    assert rows(tmp_path / "now") == []


def test_a_scan_that_is_no_longer_placed_loses_its_pose_file(tmp_path):
    (tmp_path / "now" / "poses").mkdir(parents=True)
    (tmp_path / "now" / "poses" / "c.txt").write_text("old")
    (tmp_path / "now" / "poses" / "mine.txt").write_text("not ours")
    record(tmp_path / "now", run())
    assert not (tmp_path / "now" / "poses" / "c.txt").exists()
    assert (tmp_path / "now" / "poses" / "mine.txt").exists()


def test_file_names_are_safe_and_unique():
    names = ["bun000.ply", "bun000.xyz", "BUN000.pcd", "../up/x y.ply", "scan.1", "scan.2", "é:?"]
    files = pose_files(names)
    assert files["bun000.ply"] == "bun000.txt"
    assert files["../up/x y.ply"] == "x_y.txt"
    assert files["scan.2"] == "scan.2.txt"
    assert len({file.casefold() for file in files.values()}) == len(names)
    assert not any(set(file) & set('/\\:?*"<>|') for file in files.values())
    assert pose_files([".."]) == {"..": "scan.txt"}


def test_latest_follows_the_newest_run(tmp_path):
    record(tmp_path / "one", run())
    record(tmp_path / "two", run())
    assert (tmp_path / "latest").resolve() == (tmp_path / "two").resolve()
    assert not (tmp_path / "latest").readlink().is_absolute()


def test_no_link_when_not_wanted(tmp_path):
    record(tmp_path / "now", run(), link=False)
    assert [p.name for p in tmp_path.iterdir()] == ["now"]


def test_an_interruption_after_the_end_takes_nothing_away(tmp_path):
    recorder = Recorder(tmp_path)
    for event in run(tmp_path):
        recorder.mvreg_event(event)
    before = (tmp_path / "result.json").read_text()
    assert recorder.finish_interrupted(rng=3, config={}) is None
    assert (tmp_path / "result.json").read_text() == before


def test_a_latest_of_somebody_else_is_left_alone(tmp_path):
    (tmp_path / "latest").mkdir()
    record(tmp_path / "now", run())
    assert not (tmp_path / "latest").is_symlink()


def test_where_links_are_not_allowed_a_text_says_it(tmp_path, monkeypatch):
    def refuse(*args, **kwargs):
        raise OSError("no links here")

    (tmp_path / "now").mkdir()
    monkeypatch.setattr("pathlib.Path.symlink_to", refuse)
    link_latest(tmp_path / "now")
    assert (tmp_path / "latest.txt").read_text().strip() == "now"


def test_a_folder_that_cannot_be_made_is_one_clear_message(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match=r"run folder .*hydra\.run\.dir"):
        record(tmp_path / "file" / "now", run()[:1])


def test_observers_are_hooks(tmp_path):
    manager = pluggy.PluginManager("mvreg")
    manager.add_hookspecs(hookspecs)
    out = io.StringIO()
    for observer in (
        Console(out, io.StringIO()),
        Recorder(tmp_path / "now"),
        RerunObserver(tmp_path / "now" / "run.rrd"),
    ):
        manager.register(observer)
    manager.check_pending()
    for event in run():
        manager.hook.mvreg_event(event=event)
    assert "placed 2 of 3" in out.getvalue()
    assert (tmp_path / "now" / "result.json").exists()
    assert (tmp_path / "now" / "run.rrd").stat().st_size > 10_000
