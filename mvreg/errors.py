"""The errors that mvreg raises on purpose; anything else is a bug."""


class MvregError(Exception):
    """Base of every error that a person can act on; its text is one clear message."""


class InputError(MvregError, ValueError):
    """Wrong input: says what was expected, what was found, where, and what to do."""


class PluginError(MvregError, RuntimeError):
    """A plugin or a stage cannot be used: names the culprit and what to do."""
