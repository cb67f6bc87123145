"""The contract suite of export formats, run on those of a plugin without pytest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from mvreg.errors import PluginError
from mvreg.export.brought import Guarded
from mvreg.export.formats import Format
from mvreg.kit.outcomes import Outcome, Subject
from mvreg.kit.stages import in_words, tests_of
from mvreg.testing import ExportContract

#: What the keys of formats begin with among those of stages.
PREFIX = "export/"


def check_export(
    each: Format, suites: Mapping[str, type], plugin: str, origin: str
) -> Iterator[Outcome]:
    """Run the suite of a plugin's format: an outcome per test."""
    subject = Subject(f"export={each.name}", plugin, origin)
    made: list[Any] = []
    outcome = subject.asked("has a suite", lambda: made.append(suite_of(each, suites)()))
    if not made:
        yield outcome
        return
    (suite,) = made
    own = each.write.format.write if isinstance(each.write, Guarded) else each.write
    for name in tests_of(type(suite)):
        yield subject.asked(in_words(name), getattr(suite, name), own)


def suite_of(each: Format, suites: Mapping[str, type]) -> type:
    """The class with the tests of a format.

    Raises
    ------
    PluginError
        If what the plugin has is no suite of formats, or of another one.
    """
    special = suites.get(f"{PREFIX}{each.name}")
    if special is None:
        return type("Suite", (ExportContract,), {"format": each})
    if not (isinstance(special, type) and issubclass(special, ExportContract)):
        raise PluginError(
            f"expected a subclass of mvreg.testing.ExportContract for '{PREFIX}{each.name}' of "
            f"mvreg_suites(); got {special!r}"
        )
    name = getattr(getattr(special, "format", None), "name", None)
    if name != each.name:
        raise PluginError(f"expected {special.__name__}.format to be {each.name!r}; got {name!r}")
    return special
