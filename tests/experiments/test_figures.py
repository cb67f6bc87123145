"""Figures show what the runs say, and leave a word where there is no run."""

import json
import math

import numpy as np
import pytest
from PIL import Image

from mvreg.geometry import se3
from mvreg.testing import blob_scans
from mvreg.types import ScanSet


@pytest.fixture(autouse=True)
def coarse_figures(monkeypatch):
    monkeypatch.setattr("experiments.common.style.DPI", 40)
    monkeypatch.setattr("experiments.report.panels.DPI", 40)  # to be quick


def report(dataset, pairs=14, placed=3, poses=None):
    poses = poses or {f"scan_{index}": np.eye(4).tolist() for index in range(placed)}
    return {
        "schema": 1, "status": "complete", "dataset": dataset, "rng": 0, "num_pairs": pairs,
        "reference": next(iter(poses)), "poses": poses, "resolution": 4.0,
        "unregistered": ["lost"] * (3 - placed), "seconds": {"total": 10.0 * pairs},
        "errors": {"mean": {"rotation": 0.01, "translation": 0.4}},
        "config": {"dataset": {"order": "given", "scramble": False}},
    }  # fmt: skip


def put(root, experiment, overrides, content):
    from experiments.common.runs import dirname

    folder = root / experiment / dirname(overrides)
    folder.mkdir(parents=True)
    if isinstance(content, str):
        (folder / "error.txt").write_text(content)
    else:
        (folder / "result.json").write_text(json.dumps(content))


def jobs(experiment):
    from experiments.common.runs import plan

    for overrides in plan(experiment):
        yield overrides, dict(each.lstrip("+").split("=", 1) for each in overrides)


@pytest.fixture
def blobs(monkeypatch):
    """Three small scans in the place of every data set that is asked for."""
    import mvreg

    scans = blob_scans(3)
    monkeypatch.setattr(mvreg, "dataset", lambda name, **kw: ScanSet(
        name, scans.scans, "mm", scans.poses
    ))  # fmt: skip
    return scans


def truth(scans: ScanSet):
    first = se3.invert(scans.poses[scans.scans[0].name])
    return {scan.name: (first @ scans.poses[scan.name]).tolist() for scan in scans.scans}


def words(figure):
    from matplotlib.text import Text

    return {text.get_text() for text in figure.findobj(Text)}


def test_what_a_run_says():
    from experiments.common.runs import Run
    from experiments.report.measured import measured

    found = measured(Run(None, (), report("bunny", pairs=5, placed=2), None))
    assert (found.pairs, found.seconds, found.rotation, found.translation) == (5, 50, 0.01, 0.4)
    assert (found.placed, found.total, found.complete, found.word) == (2, 3, False, "")
    apart = {**report("x", placed=2), "components": [{"poses": {"far": 0}}]}
    assert measured(Run(None, (), apart, None)).total == 4
    unknown = measured(Run(None, (), {**report("x"), "errors": None}, None))
    assert unknown.rotation is math.nan and unknown.false is None
    scans = {"near": {"angle_deg": 4.9}, "far": {"angle_deg": 5.1}}
    wrong = {**report("x"), "errors": {"scans": scans}, "consistency": {"rms_resolutions": 0.4}}
    assert measured(Run(None, (), wrong, None)).false == 1
    assert measured(Run(None, (), wrong, None)).consistency == 0.4


@pytest.mark.parametrize(
    ("error", "word"),
    [
        ("InputError: dataset=armadillo is not on this machine, and to", "not on this machine"),
        ("method=surfc is not registered; install mvreg-comparators", "not installed"),
        ("not run", "not run"),
        ("KeyError: 'x'", "failed"),
    ],
)
def test_why_a_panel_is_empty(error, word):
    from experiments.common.runs import Run
    from experiments.report.measured import measured

    found = measured(Run(None, (), None, error))
    assert found.word == word and math.isnan(found.pairs)


def test_bars_are_as_high_as_what_they_count():
    from experiments.report.bars import draw_bars
    from experiments.report.measured import Measured

    methods = {"surfc": Measured(45, 90.0, placed=10, total=10, word=""), "spant": Measured(),
               "fcpma": Measured(14, 16.0, placed=9, total=10, word="")}  # fmt: skip
    gone = dict.fromkeys(methods, Measured(word="not on this machine"))
    figure = draw_bars({"bunny": methods, "armadillo": gone}, {"bunny": 10, "armadillo": 12})
    left, right = figure.axes
    assert [bar.get_height() for bar in left.patches] == [45, 0, 0, 0, 14, 0]
    assert [bar.get_height() for bar in right.patches] == [90, 0, 0, 0, 16, 0]
    assert {"45", "14*", "16*", "*: not all placed", "not run", "not on\nthis machine"} <= words(
        figure
    )
    marked = [segment[0, 1] for lines in left.collections for segment in lines.get_segments()]
    assert marked == [9, 11, 45, 66]


def test_curves_leave_gaps_and_hollow_marks():
    from experiments.report.curves import Axis, draw_curves
    from experiments.report.measured import Measured

    full = Measured(14, 10.0, 0.01, 0.4, placed=10, total=10, word="")
    part = Measured(20, 30.0, 0.5, 0.6, placed=9, total=10, word="")
    series = {"bunny": [(2.0, part), (1.0, full), (3.0, Measured())], "dragon": [(1.0, full)]}
    figure = draw_curves(series, Axis("delta", 1.0, timed=True))
    rotation, _, pairs, _ = figure.axes
    assert [list(line.get_xdata()) for line in pairs.lines[:3]] == [[1, 2], [2], [1]]
    assert list(pairs.lines[0].get_ydata()) == [14, 20]
    assert pairs.lines[1].get_markerfacecolor() == "white"
    assert rotation.get_yscale() == "log" and pairs.get_yscale() == "linear"
    assert "dotted: FCPMA's; hollow: not all placed" in words(figure)


def test_every_figure_is_drawn_and_drawn_again_the_same(tmp_path, blobs):
    from experiments.report.figures import draw_all

    poses = truth(blobs)
    for experiment in ("table1", "table2"):
        for overrides, job in jobs(experiment):
            if job["dataset"] == "armadillo":
                put(tmp_path, experiment, overrides, "armadillo is not on this machine")
            elif job["dataset"] == "bunny" and job["method"] != "spant":
                put(tmp_path, experiment, overrides, report("bunny", poses=poses))
    for overrides, job in jobs("delta"):
        if job["seed.top_fraction"] != "0.1":
            put(tmp_path, "delta", overrides, report("bunny"))
    first = draw_all(tmp_path, tmp_path / "one")
    assert {file.name for file in first} == {
        "table1_fig7.png", "table2_fig8.png", "table2_fig9.png", "bunny.png", "delta.png"
    }  # fmt: skip
    for file, again in zip(first, draw_all(tmp_path, tmp_path / "two"), strict=True):
        assert file.read_bytes() == again.read_bytes()
        with Image.open(file) as picture:
            assert picture.width == 354
        assert not any(key in file.read_bytes() for key in (b"tIME", b"tEXt"))


def test_nothing_run_draws_nothing(tmp_path):
    from experiments.report.figures import draw_all

    assert draw_all(tmp_path, tmp_path / "out") == []


def test_the_comparison_says_what_is_missing(blobs):
    from experiments.common.scenes import load_scene
    from experiments.report.comparison import Row, draw_comparison
    from experiments.report.measured import Measured

    scene = load_scene({"fcpma": report("bunny", poses=truth(blobs))})
    done = Measured(2, 3.0, 0.0123, 0.4, placed=3, total=3, word="")
    methods = {"surfc": Measured(word="failed"), "spant": Measured(), "fcpma": done}
    gone = dict.fromkeys(methods, Measured(word="not on this machine"))
    rows = [Row("bunny", scene, methods), Row("armadillo", None, gone)]
    found = words(draw_comparison(rows, list(methods), "fcpma"))
    assert {"failed", "not run", "armadillo: not on this machine", "SurfC"} <= found
    assert "3/3 placed, $e_R$ 0.0123" in found
    assert "scans: Stanford Computer Graphics Laboratory" in found


def test_a_scene_lays_results_of_any_frame_on_each_other(blobs, rng):
    from experiments.common.scenes import load_scene

    right = truth(blobs)
    other = {name: (se3.random(rng, 50) @ np.array(pose)).tolist() for name, pose in right.items()}
    moved = se3.random(rng, 50)
    same = {name: (moved @ np.array(pose)).tolist() for name, pose in right.items()}
    same = dict(reversed(same.items()))  # another reference
    scene = load_scene({"one": report("x", poses=right), "two": report("x", poses=same),
                        "wrong": report("x", poses=other)})  # fmt: skip
    for name, pose in right.items():
        np.testing.assert_allclose(scene.poses["one"][name], pose, atol=1e-9)
        np.testing.assert_allclose(scene.poses["two"][name], pose, atol=1e-9)
    last = list(right)[-1]
    assert not np.allclose(scene.poses["wrong"][last], right[last], atol=1)
