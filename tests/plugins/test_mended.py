"""Plugins that are wrong in the ways that plugins are: each message says what mends it."""

import re
from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from fake_plugins import Half, install, mvreg, plugin_with, refused, write_metadata

from mvreg.errors import PluginError
from mvreg.events import RunStarted
from mvreg.plugins.pluggy_manager import Manager
from mvreg.plugins.registry import register_all
from mvreg.types import ScanSet

HEAD = "from dataclasses import dataclass\nfrom mvreg.stages import NearestSeed\n"
STAGES = "\ndef mvreg_stages():\n    return {'seed/odd': Odd}\n"

#: What a plugin does wrong, and what is said of it.
INSTALLED = {
    "needs": ("import nowhere_at_all", r"No module named 'nowhere_at_all'; install what it needs"),
    "divides": ("x = 1\ny = 1 / 0", r"ZeroDivisionError: .*; mend it at .*divides\.py:2, or: pip"),
    "garbled": ("def mvreg_stages(:", r"SyntaxError: .*line 1\); mend it, or: pip uninstall"),
    "mutable": (
        f"{HEAD}@dataclass(frozen=True)\nclass Odd:\n    most: list = []\n{STAGES}",
        r"mutable default .* for field most .*use default_factory; mend it at .*mutable\.py",
    ),
    "empty": (
        "def stages():\n    return {}",
        r"'empty' \(dist-empty 0\.3\) brings nothing: expected a function called one of "
        r"mvreg_stages, .* in 'empty', got none",
    ),
    "asks": (
        "def mvreg_stages(manager):\n    return {}",
        r"cannot be used: expected mvreg_stages\(\), got mvreg_stages\(manager\)$",
    ),
}


@pytest.mark.parametrize("name", INSTALLED)
def test_what_mends_a_plugin_is_said(name, tmp_path):
    source, said = INSTALLED[name]
    install(tmp_path, name, source)
    line = refused(name, tmp_path)
    assert re.search(said, line), line
    assert line.startswith(f"error: plugin '{name}' (dist-{name} 0.3) ")


def test_an_entry_point_that_names_nothing_is_told(tmp_path):
    (tmp_path / "odd.py").write_text("x = 1")
    write_metadata(tmp_path, "dist-odd", "0.3", {"odd": "odd:plugin"})
    line = refused("odd", tmp_path)
    assert "no attribute 'plugin'; the entry point has to name a module, or mod" in line


def test_a_bug_in_post_init_names_the_stage_and_whose_it_is(tmp_path):
    init = "    def __post_init__(self):\n        self.other = 3\n"
    install(
        tmp_path, "odd", f"{HEAD}@dataclass(frozen=True)\nclass Odd(NearestSeed):\n{init}{STAGES}"
    )
    done = mvreg("dataset=tiny", "+method=fcpma", "seed=odd", packages=tmp_path, cwd=tmp_path)
    assert done.returncode == 1
    assert re.search(
        r"error: seed=odd \(Odd, plugin 'odd', dist-odd 0\.3\): expected a stage made of its "
        r"parameters; got FrozenInstanceError: cannot assign to field 'other' at .*odd\.py:\d",
        done.stderr,
    ), done.stderr


@dataclass(frozen=True)
class Mute:
    size: int = 1


class Plain:
    def __call__(self, source, target): ...


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"seeds/x": Half}, r"'seeds/x' has an unknown kind; kinds: .*; did you mean 'seed/x'\?"),
        ({"nothing/x": Half}, r"unknown kind; kinds: [a-z, ]*$"),
        ({"seed/x": Plain}, r"got <class .*Plain'>; write @dataclass\(frozen=True\) above class P"),
        ({"refine/x": Half()}, r"got Half\(.*\); register the class, Half, not an object of it"),
        ({"seed/x": Mute}, r"Mute has no __call__; mvreg.contracts.Seed says what it does: __"
                           r"call__\(self, source, target\)"),
    ],
)  # fmt: skip
def test_what_mends_a_stage_is_said(table, said):
    made = Manager()
    made.add(plugin_with(table), "odd", "dist-odd 0.3")
    with pytest.raises(PluginError, match=said):
        register_all(made)


def test_a_hook_that_is_like_none_has_no_hint():
    with pytest.raises(PluginError, match=r"unknown hook 'mvreg_foo'; hooks: mvreg_stages, "):
        Manager().add(SimpleNamespace(mvreg_foo=lambda: None), "odd", "dist-odd 0.3")


def test_an_observer_that_fails_is_told_with_its_distribution(monkeypatch):
    from mvreg.plugins import manager

    def fail(event):
        raise ValueError("no")

    made = Manager()
    made.add(SimpleNamespace(mvreg_event=fail), "odd", "dist-odd 0.3")
    monkeypatch.setattr(manager, "current", lambda: made)
    with pytest.warns(manager.ObserverWarning, match=r"\(dist-odd 0\.3\) failed on RunStarted"):
        manager.emit(RunStarted(ScanSet("s", ()), "auto"))
