"""The benchmarks really run: small ones, each in processes of their own."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, nearest

EXPERIMENTS = Path(__file__).parents[2] / "experiments"


@pytest.fixture
def still(monkeypatch):
    """The code does not change while it is measured, whoever edits it."""
    from experiments.bench import records, run

    now = records.context()
    monkeypatch.setattr(run, "context", lambda: now)


def test_a_small_benchmark_measures_keeps_and_goes_on(tmp_path, still, capsys):
    from experiments.bench import run
    from experiments.bench.records import load

    file = tmp_path / "bench.json"
    words = ["methods", "--datasets", "tiny", "--only", "auto", "--rounds", "1", f"--file={file}"]
    assert run.main(words) == 0
    (record,) = load(file)
    answer = record.answer
    assert record.error is None
    assert (answer["placed"], answer["scans"], answer["false"]) == (6, 6, 0)
    assert answer["late_imports"] == []  # the clock measured no import
    stages = answer["stages"]
    assert sum(stages.values()) == pytest.approx(answer["seconds"])
    assert min(stages[name] for name in ("describe", "propagate", "refine", "adjust")) > 0
    assert record.wall > answer["seconds"] + answer["imports"] + answer["load"]
    assert 50 < answer["held_mb"] <= answer["peak_mb"] < 2000
    assert "6 of 6" in capsys.readouterr().out
    run.main(words)
    assert "kept from before" in capsys.readouterr().out
    assert len(load(file)) == 1


def test_a_run_that_fails_says_why_and_one_that_takes_too_long_too(tmp_path):
    from experiments.bench.plan import Case
    from experiments.bench.process import measure, message

    case = Case("methods", "auto", "nowhere", {"method": "auto", "dataset": "nowhere"})
    found = measure(case, 60)
    assert found.answer is None and "nowhere" in found.error
    lines = ["Traceback:", "a.b.InputError: no scans", "  searched: here", "Unpack it."]
    assert message(lines) == "a.b.InputError: no scans"
    assert message(["error: no scans", "Unpack it."]) == "error: no scans"
    assert message(["a", "b"]) == "b" and message([]) == ""
    assert measure(case, 0.01).error == "longer than 0.01 s"


def test_peers_use_all_threads_where_that_is_asked_for(monkeypatch):
    peer = pytest.importorskip("mvreg_peers.kiss_gicp")
    from types import SimpleNamespace

    from experiments.bench.free import let_loose, plain

    gicp = SimpleNamespace(preprocess_points=lambda *a, **k: (a, k), align=lambda *a, **k: (a, k))
    monkeypatch.setattr(peer, "load", lambda: ("kiss", gicp))
    monkeypatch.setattr(peer, "one_thread", "held")
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    let_loose("kiss_gicp")
    assert (peer.one_thread, peer.load()[1]) == ("held", gicp)
    let_loose("kiss_gicp+threads")
    with peer.one_thread("library"):
        _, free = peer.load()
    assert free.preprocess_points("points", 1.0) == (("points", 1.0), {"num_threads": 7})
    assert free.align(1, num_threads=1, reach=2) == ((1,), {"num_threads": 7, "reach": 2})
    assert (plain("kiss_gicp+threads"), plain("fcpma")) == ("kiss_gicp", "fcpma")


def test_larger_sizes_are_left_out_after_one_that_took_too_long(tmp_path, still, monkeypatch):
    from rich.console import Console

    from experiments.bench import run
    from experiments.bench.process import Measured

    def slow(case, limit):
        late = case.size >= 20
        return Measured(None, "longer than 9 s" if late else None, 9.0, None)

    monkeypatch.setattr(run, "measure", slow)
    monkeypatch.setattr(run, "kept_scans", lambda *_: None)
    options = run.Options(parts=["scans"], methods=["auto"], sizes=[10, 20, 40])
    made = run.Bench(tmp_path / "bench.json", 9.0, Console(quiet=True))
    made.run(run.plan(options))
    assert [record.error for record in made.records] == [
        None, "longer than 9 s", "longer than 9 s with 20 already",
    ]  # fmt: skip


def test_code_that_changes_ends_the_benchmark(tmp_path, monkeypatch):
    from rich.console import Console

    from experiments.bench import run
    from experiments.bench.process import Measured

    contexts = iter("ab")
    known = run.context()
    monkeypatch.setattr(run, "context", lambda: run.replace(known, code=next(contexts)))
    monkeypatch.setattr(run, "measure", lambda case, limit: Measured(None, None, 1.0, None))
    made = run.Bench(tmp_path / "bench.json", 9.0, Console(quiet=True))
    with pytest.raises(SystemExit, match="changed"):
        made.run(run.plan(run.Options(parts=["start"])))
    assert not (tmp_path / "bench.json").exists()


def test_an_unknown_part_is_told_what_there_is(capsys):
    from experiments.bench import run

    with pytest.raises(SystemExit):
        run.main(["method"])
    assert "no part method; there are: methods, start" in capsys.readouterr().err


def test_the_column_is_the_same_however_many_scans_there_are(tmp_path):
    from experiments.bench.column import Column, keep

    keep(tmp_path / "a", 2, 2000, 3.0)
    keep(tmp_path / "b", 1, 2000, 3.0)
    first, second = Column(folder=str(tmp_path / "a"), views=2)(np.random.default_rng()).scans
    (other,) = Column(folder=str(tmp_path / "b"), views=1)(np.random.default_rng()).scans
    assert np.array_equal(first.points, other.points) and first.knows_sensor
    assert 1600 < len(first.points) < 2400
    assert len(second.points) != len(first.points) or not np.array_equal(
        first.points, second.points
    )


def test_true_poses_put_the_column_together_and_far_scans_share_nothing(tmp_path):
    from experiments.bench.column import one

    def placed(index):
        scan, pose = one(index, 2000, 3.0)
        return se3.apply(pose, scan.points)

    zero, one_, far = placed(0), placed(1), placed(40)
    distances, _ = nearest(build_tree(zero), one_, 4.0)
    assert np.isfinite(distances).mean() > 0.5
    assert np.isinf(nearest(build_tree(zero), far, 4.0)[0]).all()


def test_the_column_can_be_kept_by_a_command(tmp_path):
    words = ["-m", "experiments.bench.column", str(tmp_path)]
    words += ["--views=1", "--points=500", "--step=6"]
    subprocess.run([sys.executable, *words], check=True, timeout=120, cwd=EXPERIMENTS.parent)
    assert [file.name for file in tmp_path.iterdir()] == ["column_000.npz"]


def test_the_micro_benchmarks_are_found_and_left_out_of_the_tests():
    words = ["-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    found = subprocess.run(
        [sys.executable, *words, str(EXPERIMENTS / "micro")], capture_output=True, text=True,
        timeout=120, check=False, cwd=EXPERIMENTS.parent,
        env={name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")},
    )  # fmt: skip
    assert found.returncode == 0, found.stdout + found.stderr
    assert "test_nearest" not in found.stdout and "test_aligned[scipy]" in found.stdout
    import tomllib

    settings = tomllib.loads((EXPERIMENTS.parent / "pyproject.toml").read_text())
    assert settings["tool"]["pytest"]["ini_options"]["testpaths"] == ["tests", "plugins"]


def test_what_is_kept_of_micro_benchmarks():
    from experiments.bench.process import summed_up

    stats = {"median": 1.0, "min": 0.5, "max": 2.0, "rounds": 3, "data": [1.0]}
    found = summed_up({"benchmarks": [{"group": None, "name": "test_a[b]", "stats": stats}]})
    assert found == {"benchmarks": [
        {"group": "", "name": "test_a[b]", "median": 1.0, "min": 0.5, "max": 2.0, "rounds": 3},
    ]}  # fmt: skip
    assert json.loads(json.dumps(found)) == found
