"""What a check of a plugin found, and how an error reads there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any
from unittest import SkipTest

from mvreg.errors import MvregError, RecordError
from mvreg.stage_calls.culprit import raised


class Status(Enum):
    """How a check ended."""

    passed = "passed"
    failed = "failed"
    skipped = "skipped"


@dataclass(frozen=True)
class Subject:
    """Something to check, and whose it is.

    Parameters
    ----------
    name : str
        ``seed=mutual``, ``+method=mutual``, ``the plugin``.
    plugin, origin : str
        The name of the entry point, and the distribution with its version.
    """

    name: str
    plugin: str
    origin: str

    def asked(self, check: str, question: Callable[[], object], culprit: Any = None) -> Outcome:
        """Ask it something: what `question` raises is the answer."""
        try:
            question()
        except SkipTest as reason:
            return self.outcome(check, Status.skipped, str(reason))
        except Exception as error:  # of code that is not ours
            return self.outcome(check, Status.failed, told(error, culprit))
        return self.outcome(check, Status.passed)

    def outcome(self, check: str, status: Status, text: str = "") -> Outcome:
        """What came of it."""
        return Outcome(self, check, status, text)


@dataclass(frozen=True)
class Outcome:
    """One check of one thing that a plugin brings.

    Parameters
    ----------
    subject : Subject
        What was checked.
    check : str
        What was asked of it, as a sentence.
    status : Status
    text : str
        What was expected and what came; empty where it passed.
    """

    subject: Subject
    check: str
    status: Status
    text: str = ""


def told(error: Exception, culprit: Any) -> str:
    """An error in words: what was expected, what came, and in which case."""
    notes = "".join(f"; {note}" for note in getattr(error, "__notes__", ()))
    own = isinstance(error, AssertionError | MvregError) and not isinstance(error, RecordError)
    if own and str(error):
        return f"{' '.join(str(error).split())}{notes}"
    came = raised(error, culprit) if isinstance(culprit, type) else (
        f"got {type(error).__name__}: {' '.join(str(error).split())}"
    )  # fmt: skip
    return f"expected an answer; {came}{notes}"
