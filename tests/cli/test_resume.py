"""Sweeps that were cut short go on where they stopped; what failed says so in its folder."""

import json
import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.plugins import Plugins
from hydra.core.singleton import Singleton
from omegaconf import OmegaConf

from mvreg.cli import main as cli
from mvreg.cli import resume
from mvreg.config import compose
from mvreg.errors import InputError
from mvreg.parallel import threads
from mvreg.report.json_file import dumps

#: Two scans so small that one is not placed: exit code 3, in a second.
TINY = ["dataset=tiny", "dataset.views=2", "dataset.points=1500", "propagate.samples=20"]
SWEEP = ["+experiment=delta", *TINY, "seed.top_fraction=0.3,0.5,1.0"]


def report_of(composed, **changes):
    """As much of a report as matters here."""
    plain = OmegaConf.to_container(composed, resolve=True, enum_to_str=True)
    found = {"schema": 1, "status": "complete", "config": plain, "poses": {"a": 1},
             "unregistered": [], "scans": [{"name": "a"}], "commit": None}  # fmt: skip
    return {**found, **changes}


def leave(folder, report):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "result.json").write_text(dumps(report))


def composed(*words):
    return compose.compose(["+method=fcpma", "dataset=tiny", "rerun=false", *words])


def test_the_same_configuration_is_finished(tmp_path):
    assert resume.finished(tmp_path, composed()) is None
    leave(tmp_path, report_of(composed()))
    for same in ([], ["resume=true"], ["debug=true"], ["dataset.order=given"]):
        assert resume.finished(tmp_path, composed(*same)) is not None
    leave(tmp_path, report_of(composed(), status="incomplete"))
    assert resume.finished(tmp_path, composed()) is not None


@pytest.mark.parametrize(
    "other", ["rng=1", "seed.top_fraction=0.31", "judge=tmse", "dataset.order=shuffle"]
)
def test_another_configuration_is_not(tmp_path, other):
    leave(tmp_path, report_of(composed()))
    assert resume.finished(tmp_path, composed(other)) is None


def test_a_value_that_json_cannot_say_is_no_other_configuration(tmp_path):
    words = ["judge.max_residual=inf"]
    leave(tmp_path, report_of(composed(*words)))
    assert resume.finished(tmp_path, composed(*words)) is not None


def test_what_was_cut_short_or_failed_is_not_finished(tmp_path):
    leave(tmp_path, report_of(composed(), status="interrupted"))
    assert resume.finished(tmp_path, composed()) is None
    leave(tmp_path, report_of(composed()))
    (tmp_path / "error.txt").write_text("no scans\n")
    assert resume.finished(tmp_path, composed()) is None
    (tmp_path / "error.txt").unlink()
    (tmp_path / "result.json").write_text(dumps(report_of(composed()))[:100])
    assert resume.finished(tmp_path, composed()) is None


def test_a_recording_that_is_wanted_must_be_there(tmp_path):
    leave(tmp_path, report_of(composed()))
    assert resume.finished(tmp_path, composed("rerun=true")) is None
    (tmp_path / "run.rrd").touch()
    assert resume.finished(tmp_path, composed("rerun=true")) is not None


def test_the_line_names_the_folder_and_another_commit(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = resume.told(report_of(composed(), unregistered=["b"]), tmp_path / "runs/x")
    assert line == "done already: runs/x: placed 1 of 1 scans"
    monkeypatch.setattr("mvreg.report.provenance.commit", lambda: "bbb")
    assert "commit" not in resume.told(report_of(composed(), commit="bbb"), tmp_path)
    assert "aaa, and now it is bbb" in resume.told(report_of(composed(), commit="aaa"), tmp_path)


@pytest.fixture
def jobs(monkeypatch, tmp_path):
    """Runs that are over at once: what they were asked for, and what they are to do."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Singleton, "_instances", dict(Singleton._instances))
    monkeypatch.delitem(Singleton._instances, GlobalHydra, raising=False)
    fake = SimpleNamespace(asked=[], answers={})

    def run_job(composed, folder):
        share = composed.seed.top_fraction
        fake.asked.append(share)
        answer = fake.answers.get(share, [])
        if isinstance(answer, BaseException):
            raise answer
        leave(folder, report_of(composed, unregistered=answer, components=[]))
        return SimpleNamespace(unregistered=answer, components=())

    fake.run_job = run_job
    monkeypatch.setitem(sys.modules, "mvreg.cli.job", fake)
    return fake


def folders(tmp_path):
    return {
        float(folder.name.rpartition("top_fraction=")[2]): folder
        for folder in (tmp_path / "runs/experiments/delta").glob("+method=*")
    }


def test_a_sweep_runs_only_what_is_missing(jobs, tmp_path, capsys):
    jobs.answers = {0.3: ["ear"], 0.5: InputError("no\nscans"), 1.0: ZeroDivisionError("zero")}
    assert cli.main(SWEEP) == cli.BUG
    found = folders(tmp_path)
    assert set(found) == {0.3, 0.5, 1.0}
    assert (found[0.5] / "error.txt").read_text() == "no\nscans\n"
    assert "bug in mvreg or a plugin: ZeroDivisionError: zero" in (
        (found[1.0] / "error.txt").read_text()
    )
    assert not (found[0.3] / "error.txt").exists()
    jobs.asked, jobs.answers = [], {}
    capsys.readouterr()
    assert cli.main(SWEEP) == cli.NOT_PLACED  # what is done already counts
    assert jobs.asked == [0.5, 1.0]
    assert capsys.readouterr().err.count("done already") == 1
    assert not list(tmp_path.rglob("error.txt"))
    jobs.asked = []
    assert cli.main([*SWEEP, "resume=false"]) == cli.DONE
    assert jobs.asked == [0.3, 0.5, 1.0]
    assert set(folders(tmp_path)) == {0.3, 0.5, 1.0}


def test_without_resume_a_folder_of_ones_own_is_written_again(jobs, tmp_path):
    words = ["dataset=tiny", "rerun=false", f"hydra.run.dir={tmp_path}/mine"]
    for _ in range(2):
        assert cli.main(words) == 0
    assert jobs.asked == [0.6, 0.6]
    assert cli.main([*words, "resume=true"]) == 0
    assert jobs.asked == [0.6, 0.6]


def test_a_method_that_is_not_installed_fails_alone(jobs, tmp_path, monkeypatch):
    from fake_plugins import use

    use(monkeypatch)
    words = ["+experiment=delta", "+method=surfc,fcpma", "dataset=tiny", "seed.top_fraction=0.3"]
    assert cli.main(words) == cli.WRONG_INPUT
    assert jobs.asked == [0.3]
    (told,) = tmp_path.rglob("error.txt")
    assert "method=surfc" in told.parent.name and "mvreg-comparators" in told.read_text()


def test_the_launcher_that_is_missing_is_told_with_its_package(monkeypatch):
    assert "pip install hydra-joblib-launcher" in no_launcher(monkeypatch)


def no_launcher(monkeypatch):
    Plugins.instance()
    repo = ConfigStore.instance().repo
    group = {**repo["hydra"], "launcher": {"basic.yaml": repo["hydra"]["launcher"]["basic.yaml"]}}
    monkeypatch.setitem(repo, "hydra", group)
    with pytest.raises(InputError) as caught:
        compose.compose(["hydra/launcher=joblib"])
    return str(caught.value)


def start(words, cwd):
    return subprocess.Popen(
        [sys.executable, "-m", "mvreg", *words], cwd=cwd, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        # A shell's background job ignores Ctrl-C, and hands that down to this test and its child.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def results(cwd):
    return {
        file.parent.name: file.stat().st_mtime_ns
        for file in (cwd / "runs/experiments/delta").glob("+method=*/result.json")
        if json.loads(file.read_text())["status"] != "interrupted"
    }


@pytest.mark.skipif(os.name != "posix", reason="signals are sent as POSIX has them")
@pytest.mark.parametrize("kind", [signal.SIGKILL, signal.SIGINT])
def test_a_sweep_that_was_ended_goes_on(kind, tmp_path):
    with start(SWEEP, tmp_path) as child:
        try:
            deadline = time.monotonic() + 300
            while not results(tmp_path) and child.poll() is None and time.monotonic() < deadline:
                time.sleep(0.02)
            os.kill(child.pid, kind)
            _, err = child.communicate(timeout=120)
        finally:
            child.kill()
    before = results(tmp_path)
    assert 1 <= len(before) < 3, err
    assert child.returncode == (130 if kind is signal.SIGINT else -signal.SIGKILL)
    with start(SWEEP, tmp_path) as again:
        out, err = again.communicate(timeout=300)
    assert again.returncode == 3, err
    after = results(tmp_path)
    assert len(after) == 3
    assert before.items() <= after.items(), "what was finished is not run again"
    assert err.count("done already: runs/experiments/delta/+method=fcpma") == len(before)
    assert out.count("placed 1 of 2 scans") == 3 - len(before)


def test_jobs_run_side_by_side_with_joblib(tmp_path):
    pytest.importorskip("hydra_plugins.hydra_joblib_launcher")
    words = [*SWEEP[:-1], "seed.top_fraction=0.3,1.0", "hydra/launcher=joblib",
             "hydra.launcher.n_jobs=2"]  # fmt: skip
    with start(words, tmp_path) as child:
        out, err = child.communicate(timeout=300)
    assert child.returncode == 3, err
    assert "Traceback" not in err and "arning" not in err
    # Two whole tables, one after the other.
    lines = [line for line in out.splitlines() if "[HYDRA]" not in line and line.strip()]
    half = len(lines) // 2
    kept = [[line.split()[0] for line in part] for part in (lines[:half], lines[half:])]
    assert kept[0] == kept[1]
    for word in ("scan", "tiny_00", "tiny_01", "placed", "written"):
        assert word in kept[0]
    reports = [
        json.loads(file.read_text())
        for file in (tmp_path / "runs/experiments/delta").glob("+method=*/result.json")
    ]
    assert len(reports) == 2
    share = max(1, (os.cpu_count() or 1) // 2)
    assert {report["machine"]["threads"] for report in reports} == {share}


def test_threads_are_limited_by_the_usual_variable(monkeypatch):
    cores = os.cpu_count()
    for value, wanted in (("3", 3), ("2,1", 2), ("", cores), ("0", cores), ("many", cores)):
        monkeypatch.setenv("OMP_NUM_THREADS", value)
        assert threads() == wanted
