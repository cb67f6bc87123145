"""The errors that mvreg raises on purpose; anything else is a bug."""


class MvregError(Exception):
    """Base of every error that a person can act on; its text is one clear message."""


class InputError(MvregError, ValueError):
    """Wrong input: says what was expected, what was found, where, and what to do."""


class PluginError(MvregError, RuntimeError):
    """A plugin or a stage cannot be used: names the culprit and what to do."""


def check_positive(stage: str, **values: float) -> None:
    """Raise InputError for the first parameter of a stage that is not positive."""
    for name, value in values.items():
        if not value > 0:
            raise InputError(f"{stage}.{name}: expected a positive number, got {value}")
