"""``mvreg plugins check``: the contract suites on what is installed, as a table and in words."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

    from mvreg.kit.outcomes import Outcome, Subject


def check(arguments: Sequence[str]) -> int:
    """Run the contract suites on the stages of plugins; exit code 0 if all pass, 1 if not."""
    parser = argparse.ArgumentParser("mvreg plugins check", description=check.__doc__)
    parser.add_argument(
        "name", nargs="?",
        help="a plugin, a distribution, or a stage as kind=name; without one, all plugins",
    )  # fmt: skip
    parser.add_argument("--all", action="store_true", help="mvreg's own stages, too")
    asked = parser.parse_args(arguments)
    from mvreg.kit.check import check_plugins
    from mvreg.kit.outcomes import Status
    from mvreg.report.table import open_console

    found = told_as_they_come(check_plugins(asked.name, asked.all))
    if not found:
        sys.stdout.write(
            "no plugin is installed beside mvreg's own; mvreg plugins check --all checks these\n"
        )
        return 0
    console = open_console(sys.stdout)
    console.print(table(found))
    for line in findings(found):
        console.print(line, markup=False, soft_wrap=True, highlight=False)
    return 1 if any(one.status is Status.failed for one in found) else 0


def told_as_they_come(outcomes: Iterable[Outcome]) -> list[Outcome]:
    """All outcomes; what is being checked is said on standard error."""
    found: list[Outcome] = []
    for one in outcomes:
        if not found or found[-1].subject != one.subject:
            sys.stderr.write(f"checking {one.subject.name}, {one.subject.origin}\n")
        found.append(one)
    return found


def table(found: Sequence[Outcome]) -> Table:
    """A row for everything that was checked."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from mvreg.kit.outcomes import Status

    shown = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for heading in ("checked", "plugin", "distribution"):
        shown.add_column(heading, overflow="fold")
    for status in Status:
        shown.add_column(status.value, justify="right")
    shown.add_column("")
    counts: dict[Subject, Counter[Status]] = {}
    for one in found:
        counts.setdefault(one.subject, Counter())[one.status] += 1
    for of, count in counts.items():
        verdict = Text("FAILED", "bold red") if count[Status.failed] else Text("ok", "green")
        whose = map(Text, (of.name, of.plugin, of.origin))
        shown.add_row(*whose, *(str(count[status]) for status in Status), verdict)
    return shown


def findings(found: Sequence[Outcome]) -> list[str]:
    """What failed and what was left out, in words; the same fault of a thing once."""
    from mvreg.kit.outcomes import Status

    lines = []
    faults: dict[tuple[Subject, Status, str], list[Outcome]] = {}
    for one in found:
        if one.status is not Status.passed:
            fault = one.text.partition("; in the case: ")[0]
            faults.setdefault((one.subject, one.status, fault), []).append(one)
    for same in faults.values():
        one, more = same[0], len(same) - 1
        of = one.subject
        who = f"{of.name} (plugin {of.plugin!r}, {of.origin})"
        others = f", and {more} other check{'s' if more > 1 else ''}" if more else ""
        lines += ["", f"{one.status.value}: {who}: {one.check}{others}", f"    {one.text}"]
    count = Counter(one.status for one in found)
    passed, failed = count[Status.passed], count[Status.failed]
    return [*lines, "", f"{passed} checks passed, {failed} failed"]
