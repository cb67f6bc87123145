"""The contract suites of `mvreg.testing`, run on registered stages without pytest."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from mvreg import testing
from mvreg.errors import PluginError
from mvreg.kit.outcomes import Outcome, Status, Subject
from mvreg.plugins.registry import REQUIRED, Registered
from mvreg.testing import SUITES

#: The test without which those that look into the answers say nothing of the stage.
FORM = "test_it_answers_in_the_right_form"
FORMLESS = "cannot be asked of answers that are not in the right form"
#: An error that came out of the suite's own code, where it looks into an answer.
IN_THE_SUITE = re.compile(rf" at {re.escape(str(Path(testing.__file__).parent))}\S+:\d+(;|$)")


def check_stage(entry: Registered, suites: Mapping[str, type]) -> Iterator[Outcome]:
    """Run the suite of a stage's kind, or what its plugin has instead: an outcome per test."""
    subject = Subject(f"{entry.kind}={entry.name}", entry.plugin, entry.origin)
    needed = [name for name, value in entry.parameters.items() if value is REQUIRED]
    if needed and entry.key not in suites:
        yield subject.outcome(
            "has a suite", Status.skipped,
            f"needs {', '.join(needed)}; let mvreg_suites() return a suite with such a stage",
        )  # fmt: skip
        return
    formless = False
    for found in outcomes_of(lambda: suite_of(entry, suites)(), subject, entry.cls):
        if formless and found.status is Status.failed and IN_THE_SUITE.search(found.text):
            yield subject.outcome(found.check, Status.skipped, FORMLESS)
        else:
            yield found
        formless |= found.check == in_words(FORM) and found.status is Status.failed


def outcomes_of(make: Callable[[], Any], subject: Subject, culprit: Any) -> Iterator[Outcome]:
    """Make a suite and run it: an outcome per test, or the one that it cannot be made."""
    made: list[Any] = []
    outcome = subject.asked("has a suite", lambda: made.append(make()), culprit)
    if not made:
        yield outcome
        return
    (suite,) = made
    for name in tests_of(type(suite)):
        yield subject.asked(in_words(name), getattr(suite, name), culprit)


def suite_of(entry: Registered, suites: Mapping[str, type]) -> type:
    """The class with the tests of a stage.

    Raises
    ------
    PluginError
        If what the plugin has is no suite of this kind, or of another stage.
    """
    contract = SUITES[entry.kind]
    special = suites.get(entry.key)
    if special is None:
        return type("Suite", (contract,), {"stage": entry.cls()})
    suite = derived(special, contract, entry.key)
    stage = getattr(suite(), "stage", None)
    if not isinstance(stage, entry.cls):
        raise PluginError(
            f"expected {suite.__name__}.stage to be a {entry.cls.__name__}; got {stage!r}"
        )
    return suite


def derived(special: object, contract: type, name: str) -> type:
    """Refuse what a plugin has as the suite of something if it is not derived from the contract."""
    if not (isinstance(special, type) and issubclass(special, contract)):
        raise PluginError(
            f"expected a subclass of mvreg.testing.{contract.__name__} for {name!r} of "
            f"mvreg_suites(); got {special!r}"
        )
    return special


def tests_of(suite: type) -> list[str]:
    """The names of a suite's tests, those of all stages first, in the order of the source."""
    found: dict[str, Any] = {}
    for cls in reversed(suite.__mro__):
        found |= {name: None for name in vars(cls) if name.startswith("test_")}
    return list(found)


def in_words(test: str) -> str:
    """A test's name as a sentence."""
    return test.removeprefix("test_").replace("_", " ")
