"""Methods that come with a distribution of their own, where it is not installed."""

import pytest
from fake_plugins import plugin_with, use

from mvreg.config import compose, known_plugins
from mvreg.errors import InputError


@pytest.mark.parametrize(("name", "package"), known_plugins.DISTRIBUTIONS.items())
def test_a_method_that_is_not_installed_is_told_with_its_package(name, package, monkeypatch):
    use(monkeypatch)
    with pytest.raises(InputError, match=rf"^\+method={name} comes with .* {package}, .* not inst"):
        compose.compose([f"+method={name}"])
    # No stage chosen by hand turns it into something that runs under a name that is not its own.
    with pytest.raises(InputError, match=package):
        compose.compose([f"+method={name}", "strategy=grow"])


def test_an_installed_method_has_no_stand_in(tmp_path, monkeypatch):
    (tmp_path / "method").mkdir()
    (tmp_path / "method/surfc.yaml").write_text("# @package _global_\nmethod: surfc\nrng: 7\n")
    use(monkeypatch, presets=plugin_with(path=str(tmp_path)))
    assert compose.compose(["+method=surfc"]).rng == 7
    with pytest.raises(InputError, match="mvreg-comparators"):
        compose.compose(["+method=spant"])


def test_stand_ins_are_not_offered(monkeypatch):
    from mvreg.config.presets import choices

    use(monkeypatch)
    assert not set(known_plugins.DISTRIBUTIONS) & set(choices()["method"])
