import os
import subprocess
import sys
import time

import numpy as np
import pytest
import rerun as rr
from observed import apart, run, scanset, view_of

from mvreg import events
from mvreg.observers.rerun import archetypes
from mvreg.observers.rerun.observer import RerunObserver, Seen, entities
from mvreg.types import Scan, View


def shown(happened) -> list[list[tuple[str, object]]]:
    """What each event shows."""
    seen, found = Seen(), []
    for event in happened:
        found.append(entities(event, seen))
        seen = seen.after(event)
    return found


def of(kind, happened) -> list[dict[str, list[object]]]:
    """For each event of a kind, the archetypes by path."""
    found = []
    for event, items in zip(happened, shown(happened), strict=True):
        if isinstance(event, kind):
            by_path: dict[str, list[object]] = {}
            for path, archetype in items:
                by_path.setdefault(path, []).append(archetype)
            found.append(by_path)
    return found


def cli(tmp_path, *words: str) -> str:
    """Rerun's own command line, kept from writing to the user's home."""
    home = {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", *words],
        env={**os.environ, **home},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_the_model_grows_by_one_cloud_per_scan():
    happened = run()
    (first,) = of(events.ReferenceChosen, happened)
    (second,) = of(events.ViewPlaced, happened)
    assert list(first) == ["model/a.ply"]
    assert list(second) == ["model/b.ply"]
    pose, cloud = second["model/b.ply"]
    assert pose.translation.as_arrow_array().to_pylist() == [[2, 0, 0]]
    assert len(cloud.positions) == 400
    other = first["model/a.ply"][1]
    assert cloud.colors.as_arrow_array() != other.colors.as_arrow_array()


def test_accepted_and_rejected_are_told_apart():
    none, good, bad = of(events.PairRegistered, run())
    assert "judge/accepted" in good and "judge/rejected" not in good
    assert "judge/rejected" in bad and "judge/accepted" not in bad
    after = [pair["pair/after"][-1].colors.as_arrow_array().to_pylist() for pair in (good, bad)]
    green, red = (
        rr.components.ColorBatch([archetypes.GREEN, archetypes.RED]).as_arrow_array().to_pylist()
    )
    assert after == [[green], [red]]
    levels = [p["verdicts"][0].level.as_arrow_array().to_pylist() for p in (none, good, bad)]
    assert levels == [["WARN"], ["INFO"], ["WARN"]]


def test_score_stands_against_threshold():
    none, good, bad = of(events.PairRegistered, run())
    value = [
        pair[path][0].scalars.as_arrow_array().to_pylist()[0]
        for pair in (good, bad)
        for path in ("judge/score", "judge/threshold", "tmse/trimmed_mse")
    ]
    assert value == [0.25, 2.0, 0.25, 4.0, 2.0, 4.0]
    assert not any(path.startswith(("judge", "tmse")) for path in none)


def test_no_candidate_takes_away_what_the_pair_before_left():
    none, good, bad = of(events.PairRegistered, run())
    for path in ("pair/after", "pair/seeds", "pair/propagated"):
        assert isinstance(none[path][0], rr.Clear)
    assert isinstance(good["pair/seeds"][0], rr.LineStrips3D)
    assert isinstance(bad["pair/seeds"][0], rr.Clear)


def test_the_source_stands_beside_the_target_and_lines_join_them():
    happened = run()
    event = next(e for e in happened if isinstance(e, events.PairRegistered) and len(e.seeds))
    aside = archetypes.beside(event.source, event.target)
    moved = event.source.points + aside[:3, 3]
    assert moved[:, 0].min() > event.target.points[:, 0].max()
    pair = of(events.PairRegistered, happened)[1]
    lines = pair["pair/seeds"][0].strips.as_arrow_array().to_pylist()
    start, end = np.array(lines[3])
    np.testing.assert_allclose(start, event.source.features.keypoints[3] + aside[:3, 3], atol=1e-4)
    np.testing.assert_allclose(end, event.target.features.keypoints[3], atol=1e-4)
    assert len(lines) == 25
    assert len(pair["pair/propagated"][0].strips.as_arrow_array()) == 12


def test_the_target_is_drawn_once_while_it_stays():
    assert ["pair/target" in p for p in of(events.PairRegistered, run())] == [True, False, True]


def test_the_last_poses_are_those_after_the_adjustment():
    happened = run()
    happened[-1].result.poses["b.ply"][0, 3] = 7.0
    (last,) = of(events.RunFinished, happened)
    (pose,) = last["model/b.ply"]
    assert pose.translation.as_arrow_array().to_pylist() == [[7, 0, 0]]


def test_a_scan_that_lost_its_pose_goes_from_the_model():
    happened = run()
    del happened[-1].result.poses["b.ply"]
    (last,) = of(events.RunFinished, happened)
    assert isinstance(last["model/b.ply"][0], rr.Clear)


@pytest.mark.parametrize("count", [1, 4999, 5000, 5001, 123_456])
def test_large_clouds_are_thinned(count):
    view = view_of(scanset().scans[0])
    points = np.arange(3.0 * count).reshape(-1, 3)
    large = View("x", points, points, view.features, 1.0, view.scale)
    drawn = len(archetypes.cloud(large, archetypes.BLUE).positions)
    assert min(count, 2500) <= drawn <= 5000


def test_clouds_of_many_scans_are_thinner():
    assert archetypes.most_points(2) == archetypes.most_points(300) == archetypes.MOST_POINTS
    assert archetypes.most_points(1000) == 1500
    assert archetypes.most_points(10**6) == archetypes.LEAST_POINTS
    view = view_of(Scan("a", np.random.default_rng(0).random((4000, 3))))
    assert len(archetypes.cloud(view, archetypes.GREY, 1500).positions) <= 1500


def test_many_matches_are_thinned():
    view = view_of(scanset().scans[0])
    many = np.zeros((12_345, 2), dtype=np.intp)
    assert 100 <= len(archetypes.matches(view, view, many, archetypes.CYAN).strips) <= 200


def test_odd_views_are_survived():
    view = view_of(scanset().scans[0], keypoints=0)
    empty = View("x", np.empty((0, 3)), np.empty((0, 3)), view.features, 0.0, view.scale)
    assert len(archetypes.cloud(empty, archetypes.BLUE).positions) == 0
    assert np.isfinite(archetypes.beside(empty, view)).all()


def test_a_recording_is_valid_and_reads_back(tmp_path):
    file = tmp_path / "deep" / "run.rrd"
    observer = RerunObserver(file)
    for event in run():
        observer.mvreg_event(event)
    observer.close()
    assert "verified without error" in cli(tmp_path, "verify", str(file))
    printed = cli(tmp_path, "print", str(file))
    for path in [
        "/model/a.ply", "/model/b.ply", "/pair/target", "/pair/before", "/pair/after",
        "/pair/seeds", "/pair/propagated", "/judge/score", "/judge/threshold", "/judge/accepted",
        "/judge/rejected", "/tmse/trimmed_mse", "/verdicts", "/confidence/scans",
        "/confidence/pairs",
    ]:  # fmt: skip
        assert f" {path} " in printed
    assert "/model/c.ply " not in printed
    assert "ViewBlueprint" in printed
    assert "LineStrips3D:strips" in printed


def test_an_interrupted_recording_is_valid(tmp_path):
    observer = RerunObserver(tmp_path / "run.rrd")
    for event in run()[:8]:
        observer.mvreg_event(event)
    observer.close()
    observer.close()
    assert "verified without error" in cli(tmp_path, "verify", str(tmp_path / "run.rrd"))


def test_recording_costs_little(tmp_path):
    happened = run()
    one_pair = [e for e in happened if not isinstance(e, events.RunStarted | events.RunFinished)]
    observer = RerunObserver(tmp_path / "run.rrd")
    observer.mvreg_event(happened[0])
    start = time.process_time()
    for _ in range(10):
        for event in one_pair:
            observer.mvreg_event(event)
    observer.close()
    assert time.process_time() - start < 1.0


def x_of(pose) -> float:
    return pose.translation.as_arrow_array().to_pylist()[0][0]


def test_poses_that_are_revised_replace_those_before():
    happened = apart()
    first, second = of(events.PosesRevised, happened)
    assert set(first) == {"model/d.ply", "model/e.ply"}
    assert set(second) == {"model/a.ply", "model/b.ply", "model/d.ply", "model/e.ply"}
    # The points of d are there since it was chosen, those of e since the first revision.
    assert [len(first[f"model/{name}"]) for name in ("d.ply", "e.ply")] == [1, 2]
    assert [len(second[f"model/{name}"]) for name in ("d.ply", "e.ply", "a.ply")] == [1, 1, 2]


def test_partial_models_stand_side_by_side():
    (last,) = of(events.RunFinished, apart())
    x = {name: x_of(last[f"model/{name}.ply"][0]) for name in "abde"}
    assert (x["a"], x["b"]) == (0, 2)
    # The plates of the first end at 19; a third of that is the gap.
    assert x["d"] == pytest.approx(19 + 0.3 * 19, abs=1e-4)
    assert x["e"] - x["d"] == pytest.approx(3, abs=1e-4)


def test_a_scan_that_is_taken_back_goes_and_may_come_again():
    happened = apart()
    gone = events.PosesRevised("a.ply", {"a.ply": np.eye(4)})
    *before, end = happened
    found = shown([*before, gone, end])
    lost = dict(found[-2])
    assert {path for path, item in lost.items() if isinstance(item, rr.Clear)} == {
        "model/b.ply", "model/d.ply", "model/e.ply",
    }  # fmt: skip
    again = [item for path, item in found[-1] if path == "model/b.ply"]
    assert [type(item) for item in again] == [rr.Transform3D, rr.Points3D]


def test_grades_and_confidences_colour_dots_and_lines():
    happened = apart()
    report = happened[-1].report
    grades = {"a.ply": "green", "b.ply": "amber", "d.ply": "red", "e.ply": None}
    for row in report["scans"]:
        if row["name"] in grades:
            row["assessment"] |= {"grade": grades[row["name"]], "confidence": 0.87}
    for link, confidence in zip(report["links"], (0.999, 0.7), strict=True):
        link["confidence"] = confidence
    (last,) = of(events.RunFinished, happened)
    (dots,), (lines,) = last["confidence/scans"], last["confidence/pairs"]
    colors = [archetypes.GREEN, archetypes.YELLOW, archetypes.RED, archetypes.GREY]
    assert dots.colors.as_arrow_array() == rr.components.ColorBatch(colors).as_arrow_array()
    assert dots.labels.as_arrow_array().to_pylist() == [
        "a.ply green 0.87", "b.ply amber 0.87", "d.ply red 0.87", "e.ply",
    ]  # fmt: skip
    assert lines.colors.as_arrow_array() == rr.components.ColorBatch(colors[:2]).as_arrow_array()
    assert lines.labels.as_arrow_array().to_pylist() == [">0.99", "0.70"]
    start, end = np.array(lines.strips.as_arrow_array().to_pylist()[0])
    spots = np.array(dots.positions.as_arrow_array().to_pylist())
    np.testing.assert_allclose(sorted([start[0], end[0]]), sorted(spots[:2, 0]), atol=1e-4)


def test_a_run_with_partial_models_is_a_valid_recording(tmp_path):
    observer = RerunObserver(tmp_path / "run.rrd")
    for event in apart():
        observer.mvreg_event(event)
    assert "verified without error" in cli(tmp_path, "verify", str(tmp_path / "run.rrd"))


def test_a_run_without_any_pair_that_overlaps_has_no_lines():
    happened = run()
    happened[-1].report["links"].clear()
    (last,) = of(events.RunFinished, happened)
    assert len(last["confidence/pairs"][0].strips) == 0
