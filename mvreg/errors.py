"""The errors that mvreg raises on purpose; anything else is a bug."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = [
    "InputError",
    "MvregError",
    "NoScanError",
    "PluginError",
    "RecordError",
    "StageError",
    "check_ascending",
    "check_positive",
]


def few(names: Sequence[str], most: int = 10) -> str:
    """The first of many names, for a message."""
    shown = ", ".join(names[:most]) or "nothing"
    return f"{shown} and {len(names) - most} more" if len(names) > most else shown


class MvregError(Exception):
    """Base of every error that a person can act on; its text is one clear message."""


class InputError(MvregError, ValueError):
    """Wrong input: says what was expected, what was found, where, and what to do."""


class NoScanError(InputError):
    """A file whose suffix may be a scan's holds something else: notes, poses, a camera matrix."""


class PluginError(MvregError, RuntimeError):
    """A plugin or a stage cannot be used: names the culprit and what to do."""


class RecordError(InputError):
    """A record, or an array for a kernel, that cannot be right: a shape, a range, a NaN.

    A person who runs mvreg can do nothing about it: out of a stage it comes as a `StageError`.
    """


class StageError(MvregError, RuntimeError):
    """A stage raised an error or returned what its contract does not allow: a bug in the stage.

    Names the stage, the plugin and the distribution that registered it, what was expected and what
    came. `stage` is the one at fault, as ``kind=name``.
    """

    def __init__(self, message: str, stage: str = "") -> None:
        super().__init__(message)
        self.stage = stage


def check_positive(stage: str, **values: float) -> None:
    """Raise InputError for the first parameter of a stage that is not positive."""
    for name, value in values.items():
        if not value > 0:
            raise InputError(f"{stage}.{name}: expected a positive number, got {value}")


def check_ascending(stage: str, **values: Sequence[float]) -> None:
    """Raise InputError for the first parameter of a stage that is not positive numbers, ascending.

    Equal ones may follow each other.
    """
    for name, value in values.items():
        if not value or sorted(value) != list(value) or value[0] <= 0:
            raise InputError(f"{stage}.{name}: expected ascending positive numbers, got {value}")
