"""Plugins whose stages do wrong: found when registered, or named on the command line."""

import re
from dataclasses import dataclass

import pytest
from fake_plugins import install, mvreg, plugin_with, use

from mvreg.contracts import KINDS
from mvreg.errors import PluginError
from mvreg.plugins.registry import register_all
from mvreg.stages import PointToPlaneJudge

SOURCE = """
from dataclasses import dataclass, replace
import numpy as np
from mvreg.types import Matches

@dataclass(frozen=True)
class Astray:
    def __call__(self, source, target):
        return Matches(np.array([[10**9, 0]]), np.zeros(1))

@dataclass(frozen=True)
class Lost:
    def __call__(self, result, views, pipeline):
        return replace(result, poses={name: np.full((4, 4), np.nan) for name in result.poses})

@dataclass(frozen=True)
class Yes:
    def __call__(self, registration, source, target, graph):
        return True

def mvreg_stages():
    return {"seed/astray": Astray, "adjust/lost": Lost, "judge/yes": Yes}
"""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            "seed=astray",
            r"Astray, plugin 'odd', dist-odd 0\.3\).*got .* position 1000000000, where",
        ),
        (
            "adjust=lost",
            r"Lost, plugin 'odd', dist-odd 0\.3\).*Result\.poses.*got nan .*odd\.py:14",
        ),
        ("judge=yes", r"Yes, plugin 'odd', dist-odd 0\.3\).*expected .* -> Verdict: .*; got True;"),
    ],
)
def test_on_the_command_line_it_is_one_message_and_exit_code_1(words, said, tmp_path):
    install(tmp_path, "odd", SOURCE)
    done = mvreg("dataset=tiny", "+method=fcpma", "strategy=sequential", words,
                 packages=tmp_path, cwd=tmp_path)  # fmt: skip
    assert done.returncode == 1, done.stderr
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"error: {words} (")
    assert re.search(said, last), last
    assert "Traceback" not in done.stderr
    assert "debug=true" in last
    assert not list(tmp_path.rglob("result.json"))


WRONG_CALLS = {
    "too few": (("seed", lambda self, source: None), r"\(self, source\)"),
    "too many": (("seed", lambda self, a, b, c: None), r"\(self, a, b, c\)"),
    "other order": (("seed", lambda self, target, source: None), r"\(self, target, source\)"),
    "by keyword only": (("refine", lambda self, source, *, target, T_init: None), "T_init"),
    "no self": (
        ("adjust", staticmethod(lambda result, views: None)),
        r"\(self, /, result, views\)",
    ),
}


@pytest.mark.parametrize("name", WRONG_CALLS)
def test_a_stage_that_cannot_be_called_is_refused_when_registered(name, monkeypatch):
    (kind, call), found = WRONG_CALLS[name]
    cls = dataclass(frozen=True)(type("Wrong", (), {"__call__": call}))
    made = use(monkeypatch, fake=plugin_with({f"{kind}/wrong": cls}))
    contract = KINDS[kind].__name__
    with pytest.raises(PluginError, match=(
        rf"'fake' \(dist-fake 0\.3\): '{kind}/wrong' .* mvreg\.contracts\.{contract} is: "
        rf"expected Wrong\.__call__\(self, .*\), got __call__.*{found}"
    )):  # fmt: skip
        register_all(made)


def test_other_names_and_further_defaults_are_free(monkeypatch):
    calls = [lambda self, a, b: None, lambda self, *given: None, lambda self, a, b, more=3: None,
             staticmethod(lambda a, b: None)]  # fmt: skip
    for call in calls:
        cls = dataclass(frozen=True)(type("Fine", (), {"__call__": call}))
        assert "seed/fine" in register_all(use(monkeypatch, fake=plugin_with({"seed/fine": cls})))


def test_what_a_judge_can_do_besides_is_held_to_its_contract(monkeypatch):
    odd = dataclass(frozen=True)(
        type("Odd", (PointToPlaneJudge,), {"rejected_early": lambda self, registration: True})
    )
    made = use(monkeypatch, fake=plugin_with({"judge/odd": odd}))
    with pytest.raises(PluginError, match=r"expected Odd\.rejected_early\(self, registration, few"):
        register_all(made)
