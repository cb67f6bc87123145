from pathlib import Path

import pytest
import yaml
from fake_plugins import use

from mvreg.cli.main import COMMANDS, main
from mvreg.config import compose
from mvreg.config.known_plugins import BROUGHT_BY
from mvreg.config.messages import WORDS, no_such_choice
from mvreg.errors import InputError
from mvreg.plugins import manager

PLUGINS = Path(__file__).parents[2] / "plugins"


@pytest.mark.parametrize("address", sorted(BROUGHT_BY))
def test_what_a_plugin_brings_is_told_with_the_plugin(address, monkeypatch):
    use(monkeypatch)  # as if no plugin were installed
    group, _, name = address.partition("/")
    package = BROUGHT_BY[address]
    with pytest.raises(InputError, match=f"{group}={name} comes with .* {package}, which is not"):
        composed = compose.compose([f"{'+' * (group == 'method')}{address.replace('/', '=')}"])
        compose.stage_from(composed, "strategy")


def test_the_message_says_how_to_install_it():
    plugin = "comes with the plugin mvreg-comparators, which is not installed; install it with: "
    command = "pip install ./plugins/mvreg-comparators"
    assert no_such_choice("strategy/surfc", []) == f"strategy=surfc {plugin}{command}"
    assert no_such_choice("method/surfc", []) == f"+method=surfc {plugin}{command}"
    assert no_such_choice("strategy/foo", ["grow"]).endswith("is not registered; options: grow")


def test_what_is_said_of_the_plugins_is_so():
    """Whatever is installed here and named in the table is where the table says."""
    for address, package in BROUGHT_BY.items():
        assert (PLUGINS / package / "pyproject.toml").is_file()
        presets = PLUGINS / package / package.replace("-", "_") / "conf" / f"{address}.yaml"
        if address.startswith("method/"):
            assert yaml.safe_load(presets.read_text())["method"] == address.partition("/")[2]
        elif address in manager.stages():
            assert manager.stages()[address].origin.startswith(package)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["my scans"], "cannot read 'my scans': it is a folder; mvreg dataset=folder 'dataset.path="
         "my scans' registers the scans in it, mvreg look 'my scans' shows"),
        (["dataset=my scans"], "dataset=my scans is no data set: it is a folder; mvreg "),
        (["dataset=./here"], "dataset.path=./here registers the scans in it"),
        (["dataset=nowhere"], "dataset=nowhere is not registered; options: "),
        (["loook"], "cannot read 'loook'; did you mean mvreg look? expected KEY=VALUE"),
        (["dataset=folder", "path=here"], "path does not exist; did you mean dataset.path? keys: "),
        (["top_fraction=0.3"], "did you mean seed.top_fraction? keys: "),
        (["dataset=folder", "dataset.path=here", "dataset.fixed=a.ply"],
         "dataset.fixed: expected a list in brackets: 'dataset.fixed=[FIRST,SECOND]'"),
        (["dataset=tiny", "export=[cloudcompar]"],
         "there is no format 'cloudcompar'; did you mean cloudcompare? formats: "),
    ],
)  # fmt: skip
def test_what_a_beginner_types_is_answered_with_what_to_type(
    words, said, tmp_path, monkeypatch, capsys
):
    (tmp_path / "my scans").mkdir()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path)
    assert main([*words, "store=false"]) == 2
    assert said in capsys.readouterr().err


def test_every_command_is_among_the_words_that_can_stand_first():
    assert set(WORDS) == set(COMMANDS)
