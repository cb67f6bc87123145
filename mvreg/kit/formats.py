"""The contract suites of formats in and out, run on those of a plugin without pytest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from mvreg.errors import PluginError
from mvreg.export.brought import Guarded
from mvreg.export.formats import Format as ExportFormat
from mvreg.io import Format
from mvreg.kit.outcomes import Outcome, Status, Subject
from mvreg.kit.stages import derived, outcomes_of
from mvreg.testing import ExportContract, ReaderContract

#: What the keys of formats out and in begin with among those of stages.
EXPORT, READER = "export/", "reader/"


def check_export(
    each: ExportFormat, suites: Mapping[str, type], plugin: str, origin: str
) -> Iterator[Outcome]:
    """Run the suite of a plugin's export format: an outcome per test."""
    subject = Subject(f"export={each.name}", plugin, origin)
    plain = type("Suite", (ExportContract,), {"format": each})
    special = suites.get(f"{EXPORT}{each.name}")
    own = each.write.format.write if isinstance(each.write, Guarded) else each.write
    yield from outcomes_of(
        lambda: _suite_of(special or plain, ExportContract, each.name), subject, own
    )


def check_reader(
    each: Format, suites: Mapping[str, type], plugin: str, origin: str
) -> Iterator[Outcome]:
    """Run the suite that a plugin has for a format it reads, which can write a file of it."""
    subject = Subject(f"reader {each.name}", plugin, origin)
    special = suites.get(f"{READER}{each.name}")
    if special is None:
        yield subject.outcome("it can be registered", Status.passed)
        yield subject.outcome(
            "has a suite", Status.skipped,
            f"needs a file; let mvreg_suites() return a mvreg.testing.ReaderContract as "
            f"'{READER}{each.name}' to have it read",
        )  # fmt: skip
        return
    yield from outcomes_of(
        lambda: _suite_of(special, ReaderContract, each.name), subject, each.read
    )


def _suite_of(special: type, contract: type, name: str) -> Any:
    """A suite, made; refused if it is none of such formats, or of another one."""
    suite = derived(special, contract, name)
    found = getattr(getattr(suite, "format", None), "name", None)
    if found != name:
        raise PluginError(f"expected {suite.__name__}.format to be {name!r}; got {found!r}")
    return suite()
