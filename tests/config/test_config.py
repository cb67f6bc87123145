import sys
from dataclasses import dataclass, fields
from pathlib import Path
from types import SimpleNamespace

import hydra
import mvreg.conf
import numpy as np
import pytest
import yaml
from fake_plugins import Half, Needy, plugin_with, use
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import OmegaConf

from mvreg.config import compose
from mvreg.contracts import KINDS
from mvreg.errors import InputError, PluginError
from mvreg.plugins import manager

CONF = Path(mvreg.conf.__file__).parent
METHODS = sorted({file.stem for file in (CONF / "method").glob("*.yaml")} - {"auto"})
DATASETS = sorted(file.stem for file in (CONF / "dataset").glob("*.yaml"))
NO_CHOICE = {"hydra/job_logging", "hydra/hydra_logging"}


BY_KIND = {k: [s for s in manager.stages().values() if s.kind == k] for k in KINDS}


@pytest.mark.parametrize("index", range(max(map(len, BY_KIND.values()))))
def test_the_key_of_a_stage_is_its_address_and_gives_its_defaults(index):
    """The first stage of every kind at once, then the second, and so on."""
    chosen = [stages[min(index, len(stages) - 1)] for stages in BY_KIND.values()]
    composed = compose.compose([f"{stage.kind}={stage.name}" for stage in chosen])
    for stage in chosen:
        found = compose.stage_from(composed, stage.kind)
        assert type(found) is stage.cls
        assert found == stage.cls()


def test_overrides_reach_the_frozen_stage():
    composed = compose.compose(["refine=tricp", "refine.min_overlap=0.25", "seed.top_fraction=1"])
    stages = compose.stages_from(composed)
    assert stages["refine"] == manager.stages()["refine/tricp"].cls(min_overlap=0.25)
    assert isinstance(stages["seed"].top_fraction, float)
    assert set(stages) == set(KINDS) - {"dataset"}
    with pytest.raises(AttributeError):
        stages["refine"].min_overlap = 0.5


@pytest.mark.parametrize("name", DATASETS)
def test_a_preset_of_a_data_set_is_its_dataclass_with_the_differences(name):
    preset = yaml.safe_load((CONF / "dataset" / f"{name}.yaml").read_text())
    base = manager.stages()[f"dataset/{preset.pop('defaults')[0]}"]
    found = compose.stage_from(compose.compose([f"dataset={name}"]), "dataset")
    assert found == base.cls(**preset)
    assert not preset.items() <= base.parameters.items()


def test_the_default_method_has_a_name_for_sweeps():
    assert compose.compose(["+method=auto"]) == compose.compose([])


@pytest.mark.parametrize("name", METHODS)
def test_a_method_spells_out_every_choice_and_its_name(name):
    file = CONF / "method" / f"{name}.yaml"
    assert file.read_text().startswith("# @package _global_\n")
    choices = [d for d in yaml.safe_load(file.read_text())["defaults"] if isinstance(d, dict)]
    made = {key.removeprefix("override /"): value for d in choices for key, value in d.items()}
    assert set(made) - NO_CHOICE == set(KINDS) - {"dataset"}
    composed = compose.compose([f"+method={name}"])
    assert composed.method == name
    for kind, stage in compose.stages_from(composed).items():
        assert type(stage) is manager.stages()[f"{kind}/{made[kind]}"].cls


def test_the_methods_of_the_paper_differ_as_the_paper_says():
    found = {name: compose.stages_from(compose.compose([f"+method={name}"])) for name in METHODS}
    table = manager.stages()
    for name, share, augment in [
        ("ocpra", 1.0, "concat"), ("ocpma", 1.0, "merge"), ("fcpma", 0.3, "merge"),
    ]:  # fmt: skip
        assert found[name]["seed"].top_fraction == share
        assert type(found[name]["augment"]) is table[f"augment/{augment}"].cls
        assert type(found[name]["judge"]) is table["judge/tmse_surface"].cls
    different = {"seed", "augment"}
    for kind in set(KINDS) - {"dataset"} - different:
        assert found["ocpra"][kind] == found["ocpma"][kind] == found["fcpma"][kind]


def test_what_the_command_line_says_last_wins_over_a_method():
    composed = compose.compose(["+method=fcpma", "seed.top_fraction=0.5", "augment=concat"])
    assert composed.seed.top_fraction == 0.5
    assert type(compose.stage_from(composed, "augment")).__name__.startswith("Concat")


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("refine=foo", "refine=foo is not registered; options: .*icp, .*tricp"),
        ("refine=", "refine= is not registered; options: .*icp, .*tricp"),
        ("refine=[tricp,foo]", "refine=foo is not registered; options: .*icp, .*tricp"),
        ("dataset=foo", "dataset=foo is not registered; options: armadillo, .*, folder, .*tiny"),
        ("+method=foo", r"\+method=foo does not exist; options: auto, fcpma, .*ocpma, ocpra"),
        (
            "method=fcpma",
            r"chosen with a plus: \+method=NAME; options: auto, fcpma, .*ocpma, ocpra",
        ),
        ("+refine=icp", "refine is chosen already; write refine=NAME, without a plus"),
        ("+method=fcpma +method=ocpra", "method is chosen already; name one"),
        ("~refine", "refine needs a choice: refine=NAME; options: .*icp, .*tricp"),
        ("seed.top_fractoin=1", "seed.top_fractoin does not exist; did you mean top_fraction?"),
        ("seed.top_fractoin=1", "parameters of seed=nearest: top_fraction"),
        ("+seed.extra=1", "seed.extra does not exist; parameters of seed=nearest: top_fraction"),
        ("adjust.x=1", "adjust.x does not exist; parameters of adjust=joint: reach, kernel"),
        ("methd=x", "methd does not exist; did you mean method?"),
        ("+methd=fcpma", "methd does not exist; did you mean method?"),
        ("++foo.bar=1", "foo does not exist; keys: dataset, .*, debug$"),
        ("seed.top_fraction=abc", "^seed.top_fraction: Value 'abc' .* not be converted to Float$"),
        ("seed.top_fraction.x=1", "^seed.top_fraction: .*dict"),
        ("rng=x", "^rng: Value 'x' .* Integer$"),
        ("rng=-1", "^rng: expected a whole number, 0 or more, got -1$"),
        ("rerun=perhaps", "^rerun: "),
        ("bunny", "cannot read 'bunny'; expected KEY=VALUE"),
        ("seed.top_fraction=[1", r"cannot read 'seed.top_fraction=\[1'"),
        ("--fast", "unknown option --fast; see mvreg --help"),
        ("hydra/launcher=nowhere", "^hydra/launcher=nowhere does not exist; options: .*basic"),
        ("seed=null", "must be a string or a list"),
    ],
)
def test_a_wrong_override_is_told_what_there_is(override, message):
    with pytest.raises(InputError, match=message) as caught:
        compose.compose(override.split())
    assert "\n" not in str(caught.value)


def test_a_preset_that_fails_is_named(tmp_path, monkeypatch):
    (tmp_path / "method").mkdir()
    (tmp_path / "method/mine.yaml").write_text("# @package _global_\nseed:\n  top: 1\n")
    use(monkeypatch, presets=plugin_with(path=str(tmp_path)))
    with pytest.raises(InputError, match=r"^method/mine.yaml: seed.top does not exist"):
        compose.compose(["+method=mine"])


def test_what_a_stage_refuses_comes_out_as_its_own_message(monkeypatch):
    use(monkeypatch, fake=plugin_with({"refine/half": Half}))
    composed = compose.compose(["refine=half", "refine.share=2"])
    with pytest.raises(InputError, match=r"^refine.share: expected at most 1, got 2.0$"):
        compose.stage_from(composed, "refine")
    composed = compose.compose(["refine=half", "refine.share=-1"])
    with pytest.raises(InputError, match=r"^refine=half: negative$"):
        compose.stage_from(composed, "refine")


def test_a_parameter_without_default_is_asked_for(monkeypatch):
    use(monkeypatch, fake=plugin_with({"refine/needy": Needy}))
    with pytest.raises(InputError, match=r"^refine=needy needs a value for refine.path=...$"):
        compose.stage_from(compose.compose(["refine=needy"]), "refine")
    composed = compose.compose(["refine=needy", "refine.path=here"])
    assert compose.stage_from(composed, "refine") == Needy("here")


def test_an_interpolation_that_leads_nowhere_is_told():
    composed = compose.compose(["seed.top_fraction=${nowhere}"])
    with pytest.raises(InputError, match=r"^seed.top_fraction: .*'nowhere' not found"):
        compose.stage_from(composed, "seed")


def test_a_plain_mapping_is_no_stage(tmp_path, monkeypatch):
    (tmp_path / "refine").mkdir()
    (tmp_path / "refine/mine.yaml").write_text("share: 1\n")
    use(monkeypatch, presets=plugin_with(path=str(tmp_path)))
    with pytest.raises(InputError, match=r"refine: expected a registered stage.*icp, .*tricp"):
        compose.stage_from(compose.compose(["refine=mine"]), "refine")


def test_a_parameter_that_a_config_cannot_hold_is_refused_by_name(monkeypatch):
    @dataclass(frozen=True)
    class Holding:
        points: np.ndarray

        def __call__(self, source, target, T_init): ...

    use(monkeypatch, fake=plugin_with({"refine/holding": Holding}))
    with pytest.raises(PluginError, match=r"'fake' \(dist-fake 0.3\).*refine/holding.*ndarray"):
        compose.compose()


@pytest.mark.parametrize("prefix", ["", "file://"])
def test_a_plugin_brings_presets(tmp_path, monkeypatch, prefix):
    (tmp_path / "refine").mkdir()
    (tmp_path / "refine/quarter.yaml").write_text("defaults: [half, _self_]\nshare: 0.25\n")
    plugin = plugin_with({"refine/half": Half}, f"{prefix}{tmp_path}")
    use(monkeypatch, presets=plugin)
    assert compose.stage_from(compose.compose(["refine=quarter"]), "refine") == Half(0.25)


def test_a_preset_does_not_shadow_a_stage(tmp_path, monkeypatch):
    (tmp_path / "refine").mkdir()
    (tmp_path / "refine/tricp.yaml").write_text("min_overlap: 0.1\n")
    use(monkeypatch, presets=plugin_with(path=str(tmp_path)))
    with pytest.raises(PluginError, match=r"'presets' .*refine/tricp.yaml.*stage of .*'mvreg'"):
        compose.compose()


def test_a_preset_does_not_hide_behind_one_of_another_owner(tmp_path, monkeypatch):
    (tmp_path / "method").mkdir()
    (tmp_path / "method/fcpma.yaml").write_text("{}\n")
    use(monkeypatch, presets=plugin_with(path=str(tmp_path)))
    with pytest.raises(PluginError, match=r"'presets' .*method/fcpma.yaml.*preset of .*'mvreg'"):
        compose.compose()


@pytest.mark.parametrize(
    "path", ["pkg://no_such_package.conf", "/no/such/folder", "conf", "http://x", 3, "pkg://"]
)
def test_a_config_path_that_does_not_exist_names_the_plugin(monkeypatch, path):
    use(monkeypatch, presets=plugin_with(path=path))
    with pytest.raises(PluginError, match=r"plugin 'presets'.*expected \"pkg://PACKAGE\""):
        compose.compose()


def test_a_config_path_hook_that_fails_is_named(monkeypatch):
    use(monkeypatch, presets=SimpleNamespace(mvreg_config_path=lambda: 1 / 0))
    with pytest.raises(
        PluginError,
        match=r"'presets' \(dist-presets 0.3\) failed in mvreg_config_path\(\): ZeroDiv",
    ):
        compose.compose()


def test_composes_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert compose.compose(["+method=fcpma"]).method == "fcpma"
    assert list(tmp_path.iterdir()) == []


def test_leaves_another_hydra_application_as_it_was(tmp_path, monkeypatch):
    (tmp_path / "app.yaml").write_text("defaults: [seed: mine, _self_]\nsize: 3\n")
    use(monkeypatch, presets=plugin_with(path=str(tmp_path / "presets")))
    (tmp_path / "presets/seed").mkdir(parents=True)
    (tmp_path / "presets/seed/leaked.yaml").write_text("{}\n")
    store = ConfigStore.instance()
    monkeypatch.setattr(store, "repo", dict(store.repo))
    store.store("mine", {"theirs": 1}, group="seed")
    store.store("nearest", {"theirs": 2}, group="seed")
    with hydra.initialize_config_dir(str(tmp_path), version_base="1.2"):
        assert hydra.compose("app") == {"seed": {"theirs": 1}, "size": 3}
        assert compose.compose(["+method=fcpma"]).seed == {"top_fraction": 0.3}
        with pytest.raises(
            InputError, match=r"options: broad, leaked, nearest$"
        ):  # theirs is not ours
            compose.compose(["seed=mine"])
        assert hydra.version.getbase().public == "1.2"
        assert hydra.compose("app", ["seed=nearest"]) == {"seed": {"theirs": 2}, "size": 3}
    with hydra.initialize_config_dir(str(tmp_path), version_base="1.2"):
        with pytest.raises(hydra.errors.MissingConfigException) as caught:
            hydra.compose("app", ["seed=leaked"])
        assert caught.value.options == ["mine", "nearest"]


def test_composes_within_a_hydra_job_and_leaves_it_as_it_was(tmp_path, monkeypatch):
    seen = []
    (tmp_path / "app.yaml").write_text("size: 3\n")
    quiet = ["hydra/job_logging=none", "hydra.job.name=theirs", f"hydra.run.dir={tmp_path}"]
    monkeypatch.setattr(sys, "argv", ["app", *quiet])

    @hydra.main(str(tmp_path), "app", "1.3")
    def app(cfg):
        application = GlobalHydra.instance().hydra
        seen.append(compose.compose(["+method=fcpma"]).method)
        assert GlobalHydra.instance().hydra is application is not None
        assert HydraConfig.get().job.name == "theirs"

    app()
    GlobalHydra.instance().clear()
    assert seen == ["fcpma"]


def test_leaves_no_hydra_application_where_there_was_none():
    assert not GlobalHydra.instance().is_initialized()
    compose.compose()
    assert not GlobalHydra.instance().is_initialized()
    with pytest.raises(InputError):
        compose.compose(["refine=foo"])
    assert not GlobalHydra.instance().is_initialized()
    assert set(KINDS).isdisjoint(ConfigStore.instance().repo)


def test_the_schema_has_a_place_for_every_kind_and_the_yaml_every_value():
    from mvreg.config.store import Schema

    names = {field.name for field in fields(Schema)}
    assert names >= set(KINDS)
    composed = compose.compose()
    assert not OmegaConf.missing_keys(composed)
    assert set(composed) == names
