import csv
import io
import json
from dataclasses import replace

import numpy as np
import pluggy
import pytest
from observed import apart, run

from mvreg import events
from mvreg.errors import InputError
from mvreg.io import read_points
from mvreg.observers.console import Console
from mvreg.observers.recorder import Recorder
from mvreg.observers.rerun.observer import RerunObserver
from mvreg.plugins import hookspecs
from mvreg.report.run_folder import link_latest, pose_files
from mvreg.types import Candidates, Matches


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


def test_what_is_placed_is_written_before_it_is_refined(tmp_path):
    happened = run()
    result = happened[-1].result
    before = [event for event in happened if not isinstance(event, events.RunFinished)]
    recorder = record(tmp_path, [*before, events.AdjustStarted(result)])
    for name, pose in result.poses.items():
        file = tmp_path / "poses" / pose_files([name])[name]
        np.testing.assert_array_equal(np.loadtxt(file), pose)
    assert not (tmp_path / "result.json").exists()
    recorder.close()


def test_pairs_are_rows(tmp_path):
    record(tmp_path / "now", run())
    hopeless, accepted, rejected = rows(tmp_path / "now")
    assert list(accepted)[:8] == [
        "source", "target", "overlap", "trimmed_mse", "threshold", "verdict", "reason", "seconds",
    ]  # fmt: skip
    assert (accepted["source"], accepted["target"]) == ("b.ply", "a.ply")
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


def files(folder) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def test_every_partial_model_has_poses_and_a_model_of_its_own(tmp_path):
    happened = apart()
    record(tmp_path / "now", happened)
    assert files(tmp_path / "now") == [
        "model.ply", "model_2.ply", "pairs.csv", "poses/a.txt", "poses/b.txt",
        "poses/component_2/d.txt", "poses/component_2/e.txt", "result.json",
    ]  # fmt: skip
    pose = np.loadtxt(tmp_path / "now/poses/component_2/e.txt")
    assert (pose == happened[-1].result.components[0]["e.ply"]).all()
    scans = {scan.name: scan.points for scan in happened[0].scanset.scans}
    expected = np.concatenate([scans["d.ply"], scans["e.ply"] + np.array([3.0, 0, 0])])
    np.testing.assert_allclose(read_points(tmp_path / "now/model_2.ply"), expected, atol=1e-5)


def joined() -> list:
    """The same run if it ends with one model."""
    start, *_, end = apart()
    return [start, replace(end, result=replace(end.result, components=()))]


def test_partial_models_of_an_earlier_run_go(tmp_path):
    record(tmp_path / "now", apart())
    (tmp_path / "now/poses/component_2/mine.txt").write_text("not ours")
    (tmp_path / "now/model_mine.ply").write_text("not ours")
    record(tmp_path / "now", joined())
    left = files(tmp_path / "now")
    assert "model_2.ply" not in left and "poses/component_2/e.txt" not in left
    assert "poses/component_2/mine.txt" in left and "model_mine.ply" in left
    (tmp_path / "now/poses/component_2/mine.txt").unlink()
    record(tmp_path / "now", apart())
    record(tmp_path / "now", joined())
    assert not (tmp_path / "now/poses/component_2").exists()


def test_what_is_revised_replaces_what_was_told_before(tmp_path):
    happened = apart()
    last = max(k for k, e in enumerate(happened) if isinstance(e, events.PosesRevised))
    recorder = record(tmp_path / "now", happened[: last + 1])
    report = json.loads(recorder.finish_interrupted(rng=3, config={}).read_text())
    assert (report["status"], report["reference"]) == ("interrupted", "a.ply")
    assert set(report["poses"]) == {"a.ply", "b.ply"}
    assert [set(part["poses"]) for part in report["components"]] == [{"d.ply", "e.ply"}]
    assert report["unregistered"] == ["s.ply", "x.ply"]
    earlier = record(tmp_path / "then", happened[:last])
    report = json.loads(earlier.finish_interrupted(rng=3, config={}).read_text())
    assert report["reference"] == "d.ply"
    assert report["components"] == []
    assert report["unregistered"] == ["a.ply", "b.ply", "s.ply", "x.ply"]


def test_a_scan_that_is_placed_leaves_its_partial_model(tmp_path):
    happened = apart()
    last = max(k for k, e in enumerate(happened) if isinstance(e, events.PosesRevised))
    placed = events.ViewPlaced("e.ply", np.eye(4))
    recorder = record(tmp_path / "now", [*happened[: last + 1], placed])
    report = json.loads(recorder.finish_interrupted(rng=3, config={}).read_text())
    assert set(report["poses"]) == {"a.ply", "b.ply", "e.ply"}
    assert [set(part["poses"]) for part in report["components"]] == [{"d.ply"}]


def test_the_confidence_comes_last(tmp_path):
    happened = apart()
    views = {e.view.name: e.view for e in happened if isinstance(e, events.ViewPrepared)}
    registered = [
        events.PairRegistered(
            views[p.source], views[p.target], Matches.none(), Candidates.none(), None, p
        )
        for p in happened[-1].result.pairs
    ]  # fmt: skip
    record(tmp_path / "now", [happened[0], *registered]).close()
    assert list(rows(tmp_path / "now")[0])[-2:] == ["score", "confidence"]
    assert [float(row["confidence"]) for row in rows(tmp_path / "now")] == [
        0.98, 0.97, 0.4, 0.8, 0.91,
    ]  # fmt: skip
    record(tmp_path / "then", run())
    assert [row["confidence"] for row in rows(tmp_path / "then")] == ["", "", ""]
