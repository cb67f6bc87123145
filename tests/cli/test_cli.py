import gc
import os
import re
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest
from fake_plugins import install, mvreg, use
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.singleton import Singleton
from observed import run as observed_run

from mvreg import __main__
from mvreg.cli import interrupts
from mvreg.cli import main as cli
from mvreg.errors import InputError
from mvreg.report.json_file import dumps

HEAVY = ("scipy", "open3d", "rerun", "rich", "pooch", "matplotlib", "hydra", "omegaconf")


class Jobs:
    """In place of `mvreg.cli.job`: notes what it was asked for, and does what `answers` says."""

    def __init__(self):
        self.answers = {}
        self.asked = []

    def run_job(self, config, folder):
        self.asked.append((config, folder))
        answer = self.answers.get(config.seed.top_fraction, ())
        if isinstance(answer, BaseException):
            raise answer
        parts = ({"ear": None},) if answer == "apart" else ()
        return SimpleNamespace(unregistered=() if parts else answer, components=parts)


@pytest.fixture
def jobs(monkeypatch, tmp_path):
    """Runs that are over at once, in an empty folder, and a process as it was afterwards."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Singleton, "_instances", dict(Singleton._instances))
    monkeypatch.delitem(Singleton._instances, GlobalHydra, raising=False)
    fake = Jobs()
    monkeypatch.setitem(sys.modules, "mvreg.cli.job", fake)
    return fake


def test_a_command_looks_for_garbage_seldom_and_not_at_its_end(monkeypatch):
    before, inside = gc.get_threshold(), []
    monkeypatch.setattr(interrupts, "listen", lambda: None)  # this process is the tests'
    monkeypatch.setattr(cli, "main", lambda: inside.append(gc.get_threshold()) or cli.NOT_PLACED)
    try:
        assert __main__.main() == cli.NOT_PLACED
        assert inside[0][0] > before[0]
        assert gc.get_freeze_count() > 0
    finally:
        gc.unfreeze()
        gc.set_threshold(*before)


def test_a_run_gets_its_configuration_and_a_folder(jobs, tmp_path):
    assert cli.main(["+method=fcpma", "dataset=tiny", "seed.top_fraction=0.5", "rng=7"]) == 0
    ((config, folder),) = jobs.asked
    assert (config.method, config.rng, config.seed.top_fraction) == ("fcpma", 7, 0.5)
    assert "hydra" not in config
    assert folder.is_absolute() and folder.is_dir()
    assert folder.parent == tmp_path / "runs/tiny/fcpma"
    assert {file.name for file in (folder / ".hydra").iterdir()} == {
        "config.yaml", "hydra.yaml", "overrides.yaml",
    }  # fmt: skip
    assert [file.name for file in folder.iterdir()] == [".hydra"]  # no empty log


def test_a_preset_has_runs_of_its_own_name(jobs, tmp_path):
    assert cli.main(["dataset=bunny"]) == 0
    assert jobs.asked[0][1].parent == tmp_path / "runs/bunny/auto"


def test_runs_within_a_second_have_folders_of_their_own(jobs):
    for _ in range(3):
        assert cli.main(["dataset=tiny"]) == 0
    assert cli.main(["-m", "dataset=tiny", "rng=1,2"]) == 0
    assert len({folder for _, folder in jobs.asked}) == 5
    assert {folder.parent.parent.name for _, folder in jobs.asked} == {"tiny"}


def test_scans_without_a_place_are_exit_code_3(jobs):
    jobs.answers[0.6] = ("ear.ply",)
    assert cli.main(["dataset=tiny"]) == 3


def test_scans_in_another_partial_model_are_exit_code_3_too(jobs):
    jobs.answers[0.6] = "apart"
    assert cli.main(["dataset=tiny"]) == 3


def test_wrong_input_is_one_line_and_exit_code_2(jobs, capsys):
    jobs.answers[0.6] = InputError("no scans in there")
    assert cli.main(["dataset=tiny"]) == 2
    assert capsys.readouterr().err == "error: no scans in there\n"


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (PermissionError(13, "Permission denied", "/there"), "Permission denied: '/there'"),
        (OSError(28, "No space left on device"), "No space left on device"),
    ],
)
def test_what_the_system_refuses_is_exit_code_2(jobs, capsys, error, message):
    jobs.answers[0.6] = error
    assert cli.main(["dataset=tiny"]) == 2
    assert capsys.readouterr().err == f"error: {message}\n"


def test_a_bug_is_called_one_and_is_exit_code_1(jobs, capsys):
    jobs.answers[0.6] = ZeroDivisionError("by zero")
    assert cli.main(["dataset=tiny"]) == 1
    err = capsys.readouterr().err
    assert err.startswith("error: this is a bug in mvreg or a plugin: ZeroDivisionError: by zero")
    assert "debug=true" in err and "Traceback" not in err


@pytest.mark.parametrize("error", [InputError("wrong"), ZeroDivisionError("wrong")])
def test_debug_shows_the_traceback(jobs, capsys, error):
    jobs.answers[0.6] = error
    assert cli.main(["dataset=tiny", "debug=true"]) in (1, 2)
    err = capsys.readouterr().err
    assert "Traceback" in err and "in run_job" in err
    assert err.splitlines()[-1].startswith("error: ")


def test_ctrl_c_is_exit_code_130_and_ends_a_sweep(jobs, capsys):
    jobs.answers[0.6] = jobs.answers[0.3] = KeyboardInterrupt()
    assert cli.main(["dataset=tiny"]) == 130
    assert capsys.readouterr().err == "interrupted\n"
    assert cli.main(["-m", "dataset=tiny", "seed.top_fraction=0.5,0.3,0.7"]) == 130
    assert len(jobs.asked) == 3


@pytest.mark.parametrize(
    ("answers", "code"),
    [
        ({0.5: ("ear",)}, 3),
        ({0.5: ZeroDivisionError(), 0.7: InputError("x")}, 1),
        ({0.5: ("ear",), 0.3: InputError("x")}, 2),
    ],
)
def test_a_failing_run_does_not_end_a_sweep_and_the_worst_code_counts(jobs, answers, code):
    jobs.answers = answers
    assert cli.main(["-m", "dataset=tiny", "seed.top_fraction=0.5,0.3,0.7"]) == code
    assert [config.seed.top_fraction for config, _ in jobs.asked] == [0.5, 0.3, 0.7]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["refine=foo"], "error: refine=foo is not registered; options: "),
        (["+method=foo"], "error: +method=foo does not exist; options: auto, fcpma, "),
        (["+methd=fcpma"], "error: methd does not exist; did you mean method?"),
        (["bunny"], "error: cannot read 'bunny'; expected KEY=VALUE"),
        (["seed=null"], "error: Config group override must be a string or a list"),
        (["-m", "seed.top_fraction=0.3,abc"], "error: seed.top_fraction: Value 'abc'"),
        (["refine=foo", "--cfg", "job"], "error: refine=foo is not registered"),
        (["plugins", "refin"], "error: 'refin' is not a kind of stage; kinds: dataset, "),
        (["inspect", "nowhere"], "error: cannot read nowhere"),
        (["inspect"], "error: no finished run below "),
    ],
)
def test_a_wrong_command_says_what_to_do(jobs, capsys, words, message):
    assert cli.main(words) == 2
    err = capsys.readouterr().err
    assert err.startswith(message) and err.count("\n") == 1
    assert jobs.asked == []


def test_an_unknown_option_is_exit_code_2(jobs, capsys):
    assert cli.main(["--fast"]) == 2
    assert "--fast" in capsys.readouterr().err


def test_debug_shows_the_traceback_of_a_wrong_command(jobs, capsys):
    assert cli.main(["refine=foo", "debug=true"]) == 2
    err = capsys.readouterr().err
    assert "Traceback" in err
    assert re.search(r"options: (\w+, )*icp, (\w+, )*tricp(, \w+)*\n$", err)


def test_leaves_the_process_as_it_was(jobs):
    argv, environment, store = sys.argv, dict(os.environ), dict(ConfigStore.instance().repo)
    shower = warnings.showwarning
    cli.main(["dataset=tiny"])
    cli.main(["refine=foo"])
    assert sys.argv is argv
    assert dict(os.environ) == environment
    assert ConfigStore.instance().repo == store
    assert warnings.showwarning is shower


def test_a_warning_is_one_line(jobs, monkeypatch, capsys):
    def warn(config, folder):
        warnings.warn("the viewer is missing", RuntimeWarning, stacklevel=1)
        return SimpleNamespace(unregistered=(), components=())

    monkeypatch.setattr(jobs, "run_job", warn)
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert cli.main(["dataset=tiny"]) == 0
    assert capsys.readouterr().err == "warning: the viewer is missing\n"


def test_shows_the_configuration_without_a_run(jobs, capsys):
    assert cli.main(["+method=fcpma", "dataset=tiny", "--cfg", "job"]) == 0
    assert "method: fcpma" in capsys.readouterr().out
    assert jobs.asked == []


@pytest.mark.parametrize("words", [["--help"], ["-h"], ["+method=fcpma", "--help"]])
def test_help_has_usage_choices_and_exit_codes(jobs, capsys, words):
    assert cli.main(words) == 0
    out = capsys.readouterr().out
    assert "Usage:" in out
    assert "\n  +method=auto|fcpma|" in out
    assert re.search(r"\n  refine=(\w+\|)*icp\|(\w+\|)*tricp(\|\w+)*\n", out)
    assert "bunny" in out
    assert "3 some scans not placed" in out
    assert max(map(len, out.splitlines())) <= 100
    assert jobs.asked == []


def test_help_of_the_words(capsys):
    assert cli.main(["plugins", "--help"]) == 0
    assert "defaults" in capsys.readouterr().out
    assert cli.main(["inspect", "--help"]) == 0
    assert "newest" in capsys.readouterr().out


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("mvreg 0.")


def test_plugins_lists_parameters_as_one_would_write_them(capsys, monkeypatch):
    use(monkeypatch)
    assert cli.main(["plugins"]) == 0
    out = capsys.readouterr().out
    assert "refine: Makes a coarse pose accurate.\n" in out
    assert "  refine=tricp  [mvreg, mvreg 0]\n" in out
    assert "      dataset.order=given\n" in out  # an Enum
    assert "      dataset.scramble=false\n" in out
    assert "      dataset.path=''\n" in out
    assert cli.main(["plugins", "seed"]) == 0
    assert [line for line in capsys.readouterr().out.splitlines() if line[:1].strip()] == [
        "seed: Proposes matches by descriptor alone."
    ]


def test_inspect_shows_the_newest_run_or_the_one_named(jobs, capsys):
    report = observed_run()[-1].report
    for age, name in [(0, "old"), (100, "new")]:
        folder = Path("runs/set/method") / name
        folder.mkdir(parents=True)
        (folder / "result.json").write_text(dumps({**report, "dataset": name}))
        os.utime(folder / "result.json", (age, age))
    Path("runs/set/method/latest").symlink_to("old")
    assert cli.main(["inspect"]) == 0
    newest = capsys.readouterr().out
    assert "b.ply" in newest and "method/new" in newest
    assert cli.main(["inspect", "runs/set/method/old"]) == 0
    assert "method/old" in capsys.readouterr().out


def test_help_loads_nothing_heavy(tmp_path):
    install(
        tmp_path, "spy",
        "import atexit, sys\n"
        "def told(): print('loaded', *(m for m in sys.modules if '.' not in m), file=sys.stderr)\n"
        "atexit.register(told)\n"
        "def mvreg_event(event): pass\n",
    )  # fmt: skip
    done = mvreg("--help", packages=tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    loaded = done.stderr.split()
    assert "numpy" in loaded
    assert not set(HEAVY) & set(loaded)


def test_output_cut_short_is_no_error(tmp_path):
    import subprocess

    command = f"{sys.executable} -m mvreg plugins | head -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert done.stdout.startswith("dataset: ")
    assert done.stderr == ""


def test_an_interrupt_that_somebody_passed_over_ends_a_sweep(jobs, monkeypatch, capsys):
    monkeypatch.setattr(cli, "interrupted", lambda: bool(jobs.asked))
    assert cli.main(["-m", "dataset=tiny", "seed.top_fraction=0.5,0.3,0.7"]) == 130
    assert len(jobs.asked) == 1
    assert capsys.readouterr().err == "interrupted\n"
