"""What the user says wins at every level, and configuration, report and run agree."""

from dataclasses import dataclass

import pytest
import yaml
from fake_plugins import mvreg, plugin_with, use

from mvreg.config import compose, levels
from mvreg.errors import InputError
from mvreg.library import dataset, register
from mvreg.report.json_file import load_report
from mvreg.run import load_method
from mvreg.stages.seed.nearest import NearestSeed

LAST = {"judge.min_overlap": 0.45, "seed.top_fraction": 1.0, "propagate.keep": 15}


def levels_of(*overrides):
    found = compose.compose(["+method=fcpma", *overrides])
    return [dict(level) for level in found.strategy.levels]


def test_a_method_has_its_levels():
    assert levels_of() == [{"judge.min_overlap": 0.6}, {"judge.min_overlap": 0.5}, LAST]


@pytest.mark.parametrize("value", ["0.3", "0.31", "1.0"])
def test_a_value_of_the_user_holds_at_every_level(value):
    *_, last = levels_of(f"seed.top_fraction={value}")
    assert last == {"judge.min_overlap": 0.45, "propagate.keep": 15}


def test_levels_that_are_the_same_then_are_one():
    wide = {"seed.top_fraction": 1.0, "propagate.keep": 15}
    assert levels_of("judge.min_overlap=0.0") == [{}, wide]
    assert levels_of("judge.min_overlap=0.6", "seed.top_fraction=0.3", "propagate.keep=5") == [{}]


def test_levels_of_the_user_are_left_alone():
    mine = "strategy.levels=[{seed.top_fraction: 0.9}]"
    assert levels_of("seed.top_fraction=0.3", mine) == [{"seed.top_fraction": 0.9}]
    with pytest.raises(InputError, match=r"strategy\.levels: cannot change 'judge.max_residual'"):
        levels_of("judge=tmse", "strategy.levels=[{judge.max_residual: 0.9}]")


def test_what_the_chosen_stage_does_not_have_does_not_apply(monkeypatch):
    @dataclass(frozen=True)
    class Plain:
        def __call__(self, source, target): ...

    use(monkeypatch, plain=plugin_with({"seed/plain": Plain}))
    assert levels_of("seed=plain")[-1] == {"judge.min_overlap": 0.45, "propagate.keep": 15}


@pytest.mark.parametrize("said", ["seed={top_fraction: 0.3}", "++seed={top_fraction: 0.3}"])
def test_a_mapping_of_the_user_holds_at_every_level_too(said):
    assert levels_of(said)[-1] == {"judge.min_overlap": 0.45, "propagate.keep": 15}
    changed = load_method("fcpma", {"seed": {"top_fraction": 0.3}})
    assert changed.strategy.levels[-1] == {"judge.min_overlap": 0.45, "propagate.keep": 15}


@pytest.mark.parametrize("chosen", ["mine", "[delta,mine]"])
def test_a_value_of_an_experiment_holds_at_every_level(monkeypatch, tmp_path, chosen):
    (tmp_path / "experiment").mkdir()
    mine = "# @package _global_\nseed:\n  top_fraction: 0.4\n"
    (tmp_path / "experiment/mine.yaml").write_text(mine)
    use(monkeypatch, mine=plugin_with({}, f"file://{tmp_path}"))
    found = levels_of(f"+experiment={chosen}")
    assert found[-1] == {"judge.min_overlap": 0.45, "propagate.keep": 15}
    assert levels_of("+experiment=noise")[-1] == LAST


def test_levels_of_the_user_are_not_made_one():
    assert levels_of("strategy.levels=[{},{}]") == [{}, {}]
    changed = levels_of("seed.top_fraction=0.3", "strategy.levels.2={seed.top_fraction: 0.9}")
    assert changed[-1] == {**LAST, "seed.top_fraction": 0.9}


def test_levels_that_are_no_mappings_are_a_strategys_own(monkeypatch):
    @dataclass(frozen=True)
    class Counted:
        levels: int = 3

        def __call__(self, views, pipeline, rng): ...

    use(monkeypatch, counted=plugin_with({"strategy/counted": Counted}))
    assert compose.compose(["strategy=counted"]).strategy.levels == 3


@pytest.mark.parametrize("level", ["{seed.top_frction: 1}", "{sead.top_fraction: 1}", "{seed: 1}"])
def test_a_level_that_names_nothing_is_refused(level):
    with pytest.raises(InputError, match=r"strategy\.levels: cannot change 's"):
        levels_of(f"strategy.levels=[{level}]")


def test_names_are_those_of_parameters():
    words = ["+method=fcpma", "seed=nearest", "judge.min_overlap=0.5", "~propagate.keep",
             "++refine.exponent=2", "seed.top_fraction=0.1,0.2", "describe={scales: 2}",
             "strategy.levels.0.x=1"]  # fmt: skip
    assert list(levels.names_in(words)) == [
        "judge.min_overlap", "propagate.keep", "refine.exponent", "seed.top_fraction",
        "describe.scales", "strategy.levels",
    ]  # fmt: skip


@dataclass(frozen=True)
class Noting(NearestSeed):
    """Nearest, and remembers with which share it was asked."""

    def __call__(self, source, target):
        SHARES.add(self.top_fraction)
        return super().__call__(source, target)


SHARES: set[float] = set()


@pytest.mark.parametrize("method", ["auto", "fcpma"])
@pytest.mark.parametrize("share", [0.3, 0.31])
def test_the_run_is_given_what_was_said(monkeypatch, method, share):
    use(monkeypatch, noting=plugin_with({"seed/noting": Noting}))
    SHARES.clear()
    scans = dataset("tiny", views=3, points=1500)
    register(scans, method, changes={"seed": "noting", "seed.top_fraction": share})
    assert {share} == SHARES


def test_auto_seeds_broadly_and_says_so():
    assert load_method().pipeline.seed.top_fraction == 0.6
    assert load_method(changes={"seed": "nearest"}).pipeline.seed.top_fraction == 0.3
    assert load_method("fcpma").pipeline.seed.top_fraction == 0.3


def test_shown_reported_and_kept_configurations_agree(tmp_path):
    words = ["+method=fcpma", "dataset=tiny", "dataset.views=2", "dataset.points=1500",
             "seed.top_fraction=0.3", "rerun=false", f"hydra.run.dir={tmp_path}/out"]  # fmt: skip
    shown = yaml.safe_load(mvreg(*words, "--cfg", "job", cwd=tmp_path).stdout)
    mvreg(*words, cwd=tmp_path)
    kept = yaml.safe_load((tmp_path / "out/.hydra/config.yaml").read_text())
    reported = load_report(tmp_path / "out")["config"]
    assert shown["strategy"] == kept["strategy"] == reported["strategy"]
    assert "seed.top_fraction" not in shown["strategy"]["levels"][-1]
    assert shown["seed"] == kept["seed"] == reported["seed"] == {"top_fraction": 0.3}
    sweep = [*words[:-1], f"hydra.sweep.dir={tmp_path}/all", "hydra.sweep.subdir=job"]
    mvreg("-m", *sweep, cwd=tmp_path)
    kept = yaml.safe_load((tmp_path / "all/job/.hydra/config.yaml").read_text())
    assert kept["strategy"] == shown["strategy"]
    assert load_report(tmp_path / "all/job")["config"]["strategy"] == shown["strategy"]
