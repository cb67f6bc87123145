"""A stage whose calls are checked, for all else the stage that it was."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from functools import cache, wraps
from typing import Any

from mvreg.errors import InputError, MvregError, RecordError
from mvreg.stage_calls.answers import CHECKS, described
from mvreg.stage_calls.culprit import is_observers, name_plugin, stage_error
from mvreg.stage_calls.nonsense import NonsenseError
from mvreg.types import View

#: The class that a checked stage's class was made of.
PLAIN = "_mvreg_plain"


def checked(kind: str, stage: Any) -> Any:
    """The stage, its calls checked: what goes wrong in it is a `StageError` that names it.

    An `InputError` is for whoever runs mvreg, and passes; where a plugin's stage has raised it, its
    text says so.

    It is of a class derived from the stage's own, so that `isinstance`, `dataclasses.replace` and
    the representation are what they were; equal it is only to a checked one.

    Parameters
    ----------
    kind : str
        Of `mvreg.contracts.KINDS`.
    stage : callable
        Comes back itself if it is checked already.
    """
    cls: type = type(stage)
    if hasattr(cls, PLAIN):
        return stage
    twin = copy(stage)
    if twin is not stage:
        try:
            object.__setattr__(twin, "__class__", _checked_class(kind, cls))
            return twin
        except TypeError:  # of a class that is not Python's
            pass
    # A function, in a pipeline put together by hand.
    return wraps(stage)(lambda *given, **named: _call(kind, "__call__", stage, stage, given, named))


def check_described(stage: Any, views: Sequence[View]) -> None:
    """Raise StageError if a ``describe`` stage has described scans each in its own way."""
    try:
        described(views)
    except NonsenseError as error:
        culprit = getattr(type(stage), PLAIN, type(stage))
        raise stage_error("describe", "__call__", culprit, f"got {error}") from None


@cache
def _checked_class(kind: str, cls: type) -> type:
    """The class derived from a stage's, with every method that its contract has checked."""
    made: type = type(
        cls.__name__,
        (cls,),
        {"__slots__": (), "__module__": cls.__module__, "__qualname__": cls.__qualname__,
         "__doc__": cls.__doc__, PLAIN: cls, "__reduce__": _reduced(kind, cls)},
    )  # fmt: skip
    for asked, name in CHECKS:
        if asked == kind and hasattr(cls, name):
            setattr(made, name, _checked_method(kind, name, made, cls))
    return made


def _reduced(kind: str, cls: type) -> Callable[[Any], tuple[Any, ...]]:
    """How another process makes a checked stage: of the plain one, which it can import."""

    def reduced(self: Any) -> tuple[Any, ...]:
        plain: Any = object.__new__(cls)
        kept = getattr(self, "__dict__", {})
        own = kept or {name: getattr(self, name) for name in getattr(cls, "__slots__", ())}
        for name, value in own.items():
            object.__setattr__(plain, name, value)
        return checked, (kind, plain)

    return reduced


def _checked_method(kind: str, name: str, made: type, cls: type) -> Callable[..., Any]:
    """A method that calls the one it stands for, and checks the answer."""

    @wraps(getattr(cls, name))
    def method(self: Any, *given: Any, **named: Any) -> Any:
        return _call(kind, name, cls, getattr(super(made, self), name), given, named)

    return method


def _call(
    kind: str,
    method: str,
    culprit: Any,
    function: Callable[..., Any],
    given: tuple[Any, ...],
    named: dict[str, Any],
) -> Any:
    """Call a stage's method; `culprit` is the stage's class, or the stage if it is a function."""
    try:
        answer = function(*given, **named)
    except Exception as error:
        if _known(kind, error):
            if isinstance(error, InputError):
                name_plugin(kind, culprit, error)
            raise
        raise stage_error(kind, method, culprit, error) from error
    try:
        CHECKS[kind, method](answer, *given, *named.values())
    except (NonsenseError, RecordError) as error:
        raise stage_error(kind, method, culprit, f"got {error}") from None
    return answer


def _known(kind: str, error: Exception) -> bool:
    """Whether an error says by itself what to do, or is no stage's."""
    if isinstance(error, MvregError):
        return not isinstance(error, RecordError)
    return is_observers(error) or (kind == "dataset" and isinstance(error, OSError))
