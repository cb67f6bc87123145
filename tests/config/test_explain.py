from pathlib import Path

import pytest
import yaml
from fake_plugins import use

from mvreg.config import compose
from mvreg.config.known_plugins import BROUGHT_BY
from mvreg.config.messages import no_such_choice
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
