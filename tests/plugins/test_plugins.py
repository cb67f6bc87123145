import re
from dataclasses import dataclass
from importlib.metadata import EntryPoint, version
from pathlib import Path
from types import SimpleNamespace

import pytest
from fake_plugins import Half, install, mvreg, plugin_with, refused, use

from mvreg.contracts import KINDS
from mvreg.errors import PluginError
from mvreg.plugins import manager
from mvreg.plugins.hookspecs import hookimpl
from mvreg.plugins.registry import REQUIRED, register_all

EVENT = SimpleNamespace(name="an event")


class Seen:
    """An observer that writes down who was called."""

    def __init__(self, log: list, name: str = "", error: BaseException | None = None):
        self.log, self.name, self.error = log, name, error

    @hookimpl
    def mvreg_event(self, event):
        self.log.append((self.name, event))
        if self.error is not None:
            raise self.error


def collected(**named) -> dict:
    made = manager.Manager()
    for name, plugin in named.items():
        made.add(plugin, name, f"dist-{name} 0.3")
    return register_all(made)


def test_built_in_stages_come_through_the_entry_point():
    table = manager.stages()
    assert table["refine/tricp"].plugin == "mvreg"
    assert table["refine/tricp"].origin == f"mvreg {version('mvreg')}"
    assert {stage.kind for stage in table.values()} == set(KINDS)
    assert list(dict.fromkeys(stage.kind for stage in table.values())) == list(KINDS)


def test_every_built_in_stage_is_described_in_a_sentence():
    for key, stage in manager.stages().items():
        assert stage.summary.endswith("."), key


def test_a_registered_stage_knows_its_parts():
    @dataclass(frozen=True)
    class Bare:
        needed: int

        def __call__(self, source, target): ...

    table = collected(one=plugin_with({"refine/half": Half, "seed/bare": Bare}))
    half, bare = table["refine/half"], table["seed/bare"]
    assert (half.kind, half.name, half.plugin, half.origin) == (
        "refine", "half", "one", "dist-one 0.3",
    )  # fmt: skip
    assert half.summary == "Keep half of it."
    assert half.parameters == {"share": 0.5, "label": None}
    assert bare.parameters == {"needed": REQUIRED}
    assert bare.summary == "(no description)"  # not the signature that dataclass() makes up


def test_a_marker_is_not_needed_and_does_no_harm():
    marked = SimpleNamespace(mvreg_stages=hookimpl(lambda: {"refine/marked": Half}))
    plain = SimpleNamespace(mvreg_stages=lambda: {"refine/plain": Half}, mvreg_number=3)
    assert set(collected(a=marked, b=plain)) == {"refine/marked", "refine/plain"}


@pytest.mark.parametrize("mark", [hookimpl, lambda function: function])
def test_a_misspelt_hook_names_the_plugin_and_the_nearest_hook(mark):
    made = manager.Manager()
    plugin = SimpleNamespace(mvreg_stage=mark(lambda: {}))
    with pytest.raises(PluginError, match=r"'odd' .dist-odd 0.3.*'mvreg_stage'.*'mvreg_stages'"):
        made.add(plugin, "odd", "dist-odd 0.3")
    made.check_pending()
    assert not made.has_plugin("odd")


def test_a_hook_with_wrong_arguments_names_the_plugin():
    plugin = SimpleNamespace(mvreg_event=lambda happening: None)
    with pytest.raises(PluginError, match=r"'odd' \(dist-odd 0.3\).*happening"):
        manager.Manager().add(plugin, "odd", "dist-odd 0.3")


def test_two_plugins_of_one_name_are_both_named():
    made = manager.Manager()
    made.add(plugin_with({}), "same", "dist-a 1")
    with pytest.raises(PluginError, match=r"'same'.*dist-a 1.*dist-b 2"):
        made.add(plugin_with({}), "same", "dist-b 2")


def test_an_entry_point_that_cannot_be_imported_is_named():
    entry = EntryPoint("broken", "no_such_module_anywhere", "mvreg")
    with pytest.raises(PluginError, match=r"'broken'.*'no_such_module_anywhere'.*ModuleNotFound"):
        manager.build([entry])


def test_a_duplicate_key_names_both_plugins():
    table = {"refine/half": Half}
    with pytest.raises(PluginError, match=r"'refine/half'.*'one' .*dist-one.*'two' .*dist-two"):
        collected(one=plugin_with(table), two=plugin_with(table))


@dataclass
class Thawed:
    def __call__(self): ...


@dataclass(frozen=True)
class Mute:
    size: int = 1


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"refin/half": Half}, "'refin/half' has an unknown kind; kinds: dataset, downsample"),
        ({"half": Half}, "'half' is not a key; expected kind/name"),
        ({"refine/a/b": Half}, "'refine/a/b' is not a key"),
        ({"refine/Half": Half}, "'refine/Half' is not a key"),
        ({"refine/a=b": Half}, "'refine/a=b' is not a key"),
        ({3: Half}, "3 is not a key"),
        ({"refine/half": Half()}, "'refine/half': expected a frozen dataclass, got Half"),
        ({"refine/half": dict}, "'refine/half': expected a frozen dataclass, got <class 'dict'>"),
        ({"refine/half": Thawed}, "'refine/half': Thawed is not frozen"),
        ({"refine/half": Mute}, "'refine/half': Mute has no __call__"),
        ([Half], "expected mvreg_stages.* to return a dict .* got list"),
    ],
)
def test_what_is_no_stage_is_refused_by_name(table, message):
    with pytest.raises(PluginError, match=rf"'odd' \(dist-odd 0.3\).*{message}"):
        collected(odd=plugin_with(table))


def test_a_hook_that_fails_is_named():
    plugin = SimpleNamespace(mvreg_stages=lambda: 1 / 0)
    with pytest.raises(PluginError, match=r"'odd' .*mvreg_stages\(\): ZeroDivisionError"):
        collected(odd=plugin)


def test_observers_see_the_events_of_one_run_in_the_order_given(monkeypatch):
    in_use = use(monkeypatch)
    log = []
    with manager.observing(Seen(log, "first"), Seen(log, "second")):
        manager.emit(EVENT)
    manager.emit(EVENT)
    assert log == [("first", EVENT), ("second", EVENT)]
    assert in_use.hook.mvreg_event.get_hookimpls() == []


def test_an_observer_that_fails_is_switched_off_and_reported_once(monkeypatch):
    use(monkeypatch)
    log = []
    bad = Seen(log, "bad", ValueError("disk full"))
    with manager.observing(bad, Seen(log, "good")):
        with pytest.warns(manager.ObserverWarning, match="Seen .*SimpleNamespace.*disk full") as w:
            manager.emit(EVENT)
            manager.emit(EVENT)
        assert len(w) == 1
    assert [name for name, _ in log] == ["bad", "good", "good"]
    with manager.observing(bad), pytest.warns(manager.ObserverWarning):  # a new run, a new chance
        manager.emit(EVENT)


def test_a_plugin_whose_observer_fails_keeps_its_stages(monkeypatch):
    def fail(event):
        raise ValueError

    plugin = SimpleNamespace(mvreg_stages=lambda: {"refine/half": Half}, mvreg_event=fail)
    use(monkeypatch, both=plugin)
    with pytest.warns(manager.ObserverWarning):
        manager.emit(EVENT)
    assert "refine/half" in manager.stages()


def test_ctrl_c_in_an_observer_is_not_swallowed(monkeypatch):
    in_use = use(monkeypatch)
    with (
        pytest.raises(KeyboardInterrupt),
        manager.observing(Seen([], error=KeyboardInterrupt())),
    ):
        manager.emit(EVENT)
    assert in_use.hook.mvreg_event.get_hookimpls() == []


def test_an_observer_with_a_misspelt_hook_leaves_no_other_behind(monkeypatch):
    in_use = use(monkeypatch)
    odd = SimpleNamespace(mvreg_events=lambda event: None)
    with (
        pytest.raises(PluginError, match="did you mean 'mvreg_event'"),
        manager.observing(odd, Seen([])),
    ):
        raise AssertionError
    assert in_use.hook.mvreg_event.get_hookimpls() == []


BROKEN = {
    "cannot_import": ("import nowhere_to_be_found", "cannot be imported.*nowhere_to_be_found"),
    "quits": ("raise SystemExit(0)", "cannot be imported.*SystemExit"),
    "misspelt": ("def mvreg_stags(): return {}", "mvreg_stags.*mvreg_stages"),
    "doubles": (
        "from mvreg.stages.refine.trimmed import ICP\n"
        "def mvreg_stages(): return {'refine/icp': ICP}",
        "'refine/icp' is registered twice.*'mvreg'",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_an_installed_plugin_that_is_broken_is_named_without_a_traceback(name, tmp_path):
    source, message = BROKEN[name]
    install(tmp_path, name, source)
    assert re.search(message, refused(name, tmp_path))


def test_an_installed_plugin_is_listed_with_its_distribution(tmp_path):
    install(tmp_path, "helpful", "from fake_plugins import plugin_with, Half\n"
            "mvreg_stages = plugin_with({'refine/half': Half}).mvreg_stages\n")  # fmt: skip
    packages = f"{tmp_path}:{Path(__file__).parents[1] / 'support'}"
    done = mvreg("plugins", "refine", packages=packages, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "refine=half  [helpful, dist-helpful 0.3]\n      Keep half of it.\n" in done.stdout
    assert "refine.share=0.5" in done.stdout
