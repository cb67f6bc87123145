"""Whether a stage can be called as the contract of its kind calls it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

from mvreg.contracts import KINDS, JointJudge, ScreeningJudge

#: Methods that a stage of a kind may have beside ``__call__``, and who asks for them.
OPTIONAL: dict[str, dict[str, type]] = {
    "judge": {"rejected_early": ScreeningJudge, "together": JointJudge}
}


def misfit(kind: str, cls: type) -> str | None:
    """What is wrong with the parameters of a stage's methods, None where nothing is.

    Stages are called with positional arguments: what counts is how many a method takes, and that
    those that it calls as the contract does stand where the contract has them. Other names are
    free, and so are further parameters with defaults.
    """
    for method, contract in (("__call__", KINDS[kind]), *OPTIONAL.get(kind, {}).items()):
        if not hasattr(cls, method):
            continue
        wanted = _plain(getattr(contract, method))
        if _plain(getattr(cls, method)) == wanted:
            continue
        found = _signature(cls, method)
        if found is not None and not _fits(found, wanted):
            return (
                f"expected {cls.__qualname__}.{method}({', '.join(['self', *wanted])}), "
                f"got {method}{found}"
            )
    return None


def _plain(function: object) -> list[str]:
    """The parameters of a function that has no others, without the first; quick, for most stages.

    Empty for what is more than that.
    """
    code = getattr(function, "__code__", None)
    if code is None or hasattr(function, "__wrapped__") or code.co_kwonlyargcount:
        return []
    return list(code.co_varnames[1 : code.co_argcount])


def _signature(cls: type, method: str) -> inspect.Signature | None:
    """The signature of a method, `self` included; None where Python knows none."""
    try:
        found = inspect.signature(getattr(cls, method)).replace(
            return_annotation=inspect.Signature.empty
        )
    except (TypeError, ValueError):  # built in, or no function at all
        return None
    first = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
    if isinstance(inspect.getattr_static(cls, method), staticmethod | classmethod):
        return found.replace(parameters=[first, *found.parameters.values()])
    return found


def _fits(found: inspect.Signature, wanted: list[str]) -> bool:
    """Whether a method takes so many positional arguments, and none of them in another's place."""
    try:
        found.bind(None, *wanted)
    except TypeError:
        return False
    names = list(_positional(found))[1:]
    places = {name: names.index(name) for name in wanted if name in names}
    return all(wanted.index(name) == place for name, place in places.items())


def _positional(found: inspect.Signature) -> Iterator[str]:
    """The names of the parameters that positional arguments go to, in order."""
    for name, each in found.parameters.items():
        if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD):
            yield name
