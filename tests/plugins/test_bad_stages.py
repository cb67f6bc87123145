"""Stages that answer nonsense: each is named at its first wrong act, with what it should have done.

Nothing crashes, nothing is believed: no kernel and no report sees what cannot be right.
"""

import re
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import pytest
from bad_answers import NAN, WRONG
from fake_plugins import plugin_with, use

import mvreg as library
from mvreg.contracts import KINDS, JointJudge, ScreeningJudge
from mvreg.errors import InputError, PluginError, StageError
from mvreg.stage_calls import checked
from mvreg.stages import EvidenceJudge, PointToPlaneJudge, TrimmedICP
from mvreg.testing import blob_scans, overlap

#: What a stage of each kind does, the method otherwise that of `mvreg.register`.
METHOD = {"downsample": "paper", "downsample.min_points": 700}


@dataclass(frozen=True)
class Bad:
    """Does what a test wants: answers a value, calls a function, or raises an error."""

    act: Any = None

    def __call__(self, *given: Any) -> Any:
        if isinstance(self.act, Exception):
            raise self.act
        return self.act(*given) if callable(self.act) else self.act


@dataclass(frozen=True)
class AfterAll:
    """Changes what the stage that it is put around answers."""

    stage: Any
    change: Any

    def __call__(self, *given: Any) -> Any:
        return self.change(self.stage(*given), *given)


@pytest.fixture(scope="module")
def method():
    return library.load_method("auto", METHOD)


def put(method: Any, kind: str, stage: Any) -> Any:
    """The method with another stage of a kind."""
    if kind in ("strategy", "adjust"):
        return replace(method, **{kind: stage})
    return replace(method, pipeline=method.pipeline.with_stages(**{kind: stage}))


def own(method: Any, kind: str) -> Any:
    """The stage of a kind that the method has."""
    return getattr(method if kind in ("strategy", "adjust") else method.pipeline, kind)


def message(method: Any, kind: str, stage: Any) -> str:
    """What is said when the method runs with a stage that does wrong."""
    with pytest.raises(StageError) as caught:
        library.register(blob_scans(3).scans, put(method, kind, stage))
    return str(caught.value)


RUN_KINDS = [kind for kind in KINDS if kind != "dataset"]


@pytest.mark.parametrize("kind", RUN_KINDS)
@pytest.mark.parametrize("answer", [None, True, "text", (1, 2, 3)], ids=repr)
def test_an_answer_of_another_type_is_refused(method, kind, answer):
    said = message(method, kind, Bad(answer))
    assert said.startswith(f"{kind} stage (Bad, not registered by any plugin): expected __call__(")
    contract = KINDS[kind].__call__.__annotations__["return"]
    assert f") -> {contract}: " in said
    shown = {None: "None", True: "True", "text": "str 'text'"}.get(answer, "tuple (1, 2, 3)")
    assert f"; got {shown}" in said


@pytest.mark.parametrize("kind", RUN_KINDS)
@pytest.mark.parametrize("error", [ValueError("no good"), ZeroDivisionError("by zero")], ids=repr)
def test_an_error_is_told_with_its_place(method, kind, error):
    said = message(method, kind, Bad(error))
    assert f"; got {type(error).__name__}: {error} at {__file__}:" in said
    assert said.startswith(f"{kind} stage (Bad")


@pytest.mark.parametrize("kind", RUN_KINDS)
def test_a_wrong_number_of_arguments_is_told(method, kind):
    said = message(method, kind, lambda one: None)
    assert "got TypeError" in said
    assert f"{kind} stage (" in said and "expected __call__(" in said


@pytest.mark.parametrize("kind", ["seed", "refine", "judge"])
def test_interruptions_and_errors_that_say_what_to_do_pass(method, kind):
    for error in (KeyboardInterrupt, SystemExit, InputError("install it"), PluginError("no")):

        def act(*given, error=error):
            raise error

        with pytest.raises(error if isinstance(error, type) else type(error)) as caught:
            library.register(blob_scans(3).scans, put(method, kind, Bad(act)))
        assert not isinstance(caught.value, StageError)


@dataclass(frozen=True)
class Refusing(TrimmedICP):
    """A plugin's stage that cannot take what it is given."""

    def __call__(self, *given: Any) -> Any:
        raise InputError("scan 'blob_1': expected colours")


@dataclass(frozen=True)
class Passing:
    """A plugin's strategy that calls the pipeline's refinement, and what that raises passes."""

    def __call__(self, views: Any, pipeline: Any, rng: Any) -> Any:
        return pipeline.refine(views[0], views[1], np.eye(4))


def refusal(method: Any) -> str:
    """What is said when a stage of the method refuses its input."""
    with pytest.raises(InputError) as caught:
        library.register(blob_scans(3).scans, method)
    assert type(caught.value) is InputError
    return str(caught.value)


def test_a_plugins_stage_that_refuses_its_input_is_named(method, monkeypatch):
    use(monkeypatch, fake=plugin_with({"refine/bad": Refusing, "strategy/bad": Passing}))
    said = "in refine=bad (dist-fake 0.3): scan 'blob_1': expected colours"
    assert refusal(put(method, "refine", Refusing())) == said
    # Once, whatever stages the error passes on its way: the innermost has raised it.
    assert refusal(put(put(method, "refine", Refusing()), "strategy", Passing())) == said


def test_a_stage_of_the_core_or_of_nobody_refuses_in_its_own_words(method, monkeypatch):
    def refuse(*given: Any) -> Any:
        raise InputError("refine.exponent: expected another")

    said = "refine.exponent: expected another"
    assert refusal(put(method, "refine", Bad(refuse))) == said
    use(monkeypatch, fake=plugin_with({"strategy/bad": Passing}))
    monkeypatch.setattr(TrimmedICP, "__call__", refuse)
    assert refusal(put(put(method, "refine", TrimmedICP()), "strategy", Passing())) == said


CASES = [
    pytest.param(kind, change, said, id=f"{kind}-{k}")
    for kind, each in WRONG.items()
    for k, (change, said) in enumerate(each)
]


@pytest.mark.parametrize(("kind", "change", "said"), CASES)
def test_an_answer_that_cannot_be_right_is_refused(method, kind, change, said):
    found = message(method, kind, AfterAll(own(method, kind), change))
    assert found.startswith(f"{kind} stage (AfterAll, not registered")
    assert re.search(said, found), found


@pytest.mark.parametrize(
    ("kind", "name"),
    [("strategy", "refine"), ("adjust", "refine"), ("strategy", "judge"), ("strategy", "augment")],
)
def test_a_stage_that_another_calls_is_the_one_named(method, kind, name):
    """Strategies and adjustments call stages of the pipeline by themselves."""

    def calls(given, views, pipeline):
        views = views if kind == "strategy" else given
        return getattr(pipeline, name)(views[0], views[1], np.eye(4))

    def first(*given):
        return calls(given[1], given[0], given[1]) if kind == "strategy" else calls(
            given[1], given[0], given[2])  # fmt: skip

    bad = put(put(method, name, Bad(NAN)), kind, Bad(first))
    with pytest.raises(StageError, match=rf"^{name} stage \(Bad, .* got an array \(4, 4\)"):
        library.register(blob_scans(3).scans, bad)


def test_a_checked_stage_is_for_all_else_the_stage_that_it_was():
    for kind, stage in (("judge", EvidenceJudge()), ("judge", PointToPlaneJudge()),
                        ("refine", TrimmedICP(exponent=1.5)), ("seed", Bad(3))):  # fmt: skip
        twin = checked(kind, stage)
        assert checked(kind, twin) is twin
        assert isinstance(twin, type(stage))
        assert repr(twin) == repr(stage)
        assert fields(twin) == fields(stage)
        assert twin == checked(kind, stage)
        assert hash(twin) == hash(stage)
        assert isinstance(twin, JointJudge) == isinstance(stage, JointJudge)
        assert isinstance(twin, ScreeningJudge) == isinstance(stage, ScreeningJudge)
    with pytest.raises(StageError, match="refine=tricp"):
        replace(checked("refine", TrimmedICP()), exponent=1.0)(overlap().source, None, np.eye(4))


def test_stages_with_slots_and_functions_are_checked_too():
    @dataclass(frozen=True, slots=True)
    class Slotted:
        value: int = 3

        def __call__(self, source, target):
            return self.value

    for stage in (Slotted(4), lambda source, target: 4):
        with pytest.raises(StageError, match="got int 4"):
            checked("seed", stage)(overlap().source, overlap().target)


@pytest.mark.parametrize("name", ["rejected_early", "together"])
def test_what_a_judge_can_do_besides_is_checked(name):
    @dataclass(frozen=True)
    class Odd(PointToPlaneJudge):
        def rejected_early(self, *given):
            return 0.5

        def together(self, pairs):
            return 0.5

    with pytest.raises(StageError, match=rf"Odd, .* expected {name}\(.*; got float 0.5"):
        getattr(checked("judge", Odd()), name)([])


def test_a_registered_stage_is_named_with_its_distribution(method, monkeypatch):
    use(monkeypatch, fake=plugin_with({"refine/bad": Bad}))
    said = message(method, "refine", Bad(NAN))
    assert said.startswith("refine=bad (Bad, plugin 'fake', dist-fake 0.3): expected __call__(")
    assert "tell who maintains dist-fake 0.3, or choose another: refine=" in said
    options = said.rpartition("refine=")[2].split("|")
    assert "tricp" in options and "bad" not in options
