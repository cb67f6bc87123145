"""The error that all checks of answers raise, and what they share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from mvreg.types.checks import shown


class NonsenseError(Exception):
    """What came instead of an answer, in words that follow "got"."""


def be(answer: Any, cls: type) -> None:
    """Refuse an answer of another type."""
    if not isinstance(answer, cls):
        raise NonsenseError(shown(answer))


def listed(names: Iterable[str]) -> str:
    """Names for a message."""
    return ", ".join(map(repr, names)) or "none"
