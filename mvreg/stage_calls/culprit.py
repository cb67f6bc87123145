"""Which stage of which distribution is at fault, in one message."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from mvreg.contracts import KINDS, JointJudge, ScreeningJudge
from mvreg.errors import InputError, MvregError, StageError
from mvreg.plugins import manager, traced
from mvreg.plugins.registry import Registered

#: What is not a stage's code, though a stage calls it: observers and those who wait for events.
OBSERVERS = ("mvreg.observers", "mvreg.cli")
#: The plugin that brings mvreg's own stages.
CORE = "mvreg"
#: The mark of an error that has come out of a stage.
SEEN = "_mvreg_seen"
CONTRACTS: dict[str, type] = {
    "rejected_early": ScreeningJudge,
    "together": JointJudge,
}


def stage_error(kind: str, method: str, culprit: Any, what: str | Exception) -> StageError:
    """The error to raise: the stage, what was expected of it, what came, and what to do.

    Parameters
    ----------
    kind, method : str
        What was called: ``"refine"``, ``"__call__"``.
    culprit : type or callable
        The stage's class, or the stage where it is a function.
    what : str or Exception
        What came, beginning with "got"; or what the stage raised.
    """
    entry = registered(kind, culprit)
    name = getattr(culprit, "__qualname__", type(culprit).__qualname__)
    if entry is None:
        stage, whose = f"{kind} stage", "not registered by any plugin"
        advice = "mend it, or use another stage"
    else:
        stage, whose = f"{kind}={entry.name}", f"plugin {entry.plugin!r}, {entry.origin}"
        advice = f"tell who maintains {entry.origin}, or choose another: {others(entry)}"
    came = what if isinstance(what, str) else raised(what, culprit)
    made = method == "__post_init__"
    wanted = "a stage made of its parameters" if made else signature(kind, method)
    return StageError(f"{stage} ({name}, {whose}): expected {wanted}; {came}; {advice}", stage)


def name_plugin(kind: str, culprit: Any, error: InputError) -> None:
    """Put the stage and its distribution in front of an error's text, for a stage of a plugin.

    Of stages that call each other the innermost counts: it has raised the error. mvreg's own name
    what they are about, as in ``adjust.min_overlap: expected``.

    Parameters
    ----------
    kind, culprit
        As for `stage_error`.
    error : InputError
        Is changed, and stays of its class; only the first call does anything.
    """
    if hasattr(error, SEEN):
        return
    setattr(error, SEEN, True)
    entry = registered(kind, culprit)
    if entry is not None and entry.plugin != CORE:
        error.args = (f"in {entry.kind}={entry.name} ({entry.origin}): {error}",)


def registered(kind: str, culprit: Any) -> Registered | None:
    """The entry of a stage in the table of stages; None if no plugin has registered it."""
    try:
        table = manager.stages()
    except MvregError:  # another plugin is broken: no reason to hide what this one did
        return None
    found = [entry for entry in table.values() if entry.cls is culprit]
    return next((entry for entry in found if entry.kind == kind), found[0] if found else None)


def others(entry: Registered) -> str:
    """The other stages of the kind that there are, for messages."""
    table = manager.stages().values()
    names = [each.name for each in table if each.kind == entry.kind and each.key != entry.key]
    return f"{entry.kind}={'|'.join(names)}"


def signature(kind: str, method: str) -> str:
    """What a contract asks for: ``__call__(source, target) -> Matches``, and its first words."""
    function = getattr(CONTRACTS.get(method, KINDS[kind]), method)
    asked = inspect.signature(function)
    names = ", ".join(name for name in asked.parameters if name != "self")
    words = " ".join((inspect.getdoc(function) or "").split("\n\n")[0].split()).rstrip(".")
    return f"{method}({names}) -> {asked.return_annotation}: {words[:1].lower()}{words[1:]}"


def raised(error: Exception, culprit: Any) -> str:
    """What a stage raised, and where: in the stage's own file if the error came through it."""
    return traced.raised(error, culprit, str(Path(__file__).parent))


def is_observers(error: Exception) -> bool:
    """Whether an error comes from what listens to the run, which a stage's events go to."""
    step = error.__traceback__
    while step is not None:
        if str(step.tb_frame.f_globals.get("__name__", "")).startswith(OBSERVERS):
            return True
        step = step.tb_next
    return False
