"""Scans of related runs: correctly placed, false positives, not placed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from experiments.accuracy.placements import Placements
from experiments.accuracy.truth import placements_of
from experiments.common.runs import Run
from experiments.report.measured import Measured, measured
from experiments.report.tables import number, public
from mvreg.errors import InputError
from mvreg.report.comparison.formats import markdown
from mvreg.report.comparison.spread import spread

#: More runs than these are counted, not named.
MOST_NAMED = 6


@dataclass(frozen=True)
class Outcome:
    """A run, what it measured, and where its scans ended; None where that is not known."""

    run: Run
    now: Measured
    scans: Placements | None

    @property
    def complete(self) -> bool:
        """Whether every scan is placed right."""
        return self.scans is not None and len(self.scans.right) == self.scans.total

    @property
    def pairs_per_scan(self) -> float:
        """Pairs attempted for each scan; NaN where there is no result."""
        return self.now.pairs / self.scans.total if self.scans else math.nan


@dataclass(frozen=True)
class Row:
    """Runs that belong together: what they are of, and their values of the page's labels."""

    experiment: str
    values: tuple[str, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def known(self) -> list[Outcome]:
        """The runs of which it is known where the scans ended."""
        return [each for each in self.outcomes if each.scans is not None]

    def count(self, kind: str) -> int:
        """How many scans there are of a kind: ``right``, ``false``, ``left`` or ``unknown``."""
        return sum(len(getattr(each.scans, kind)) for each in self.known)

    @property
    def total(self) -> int:
        """How many scans there are."""
        return sum(each.scans.total for each in self.known if each.scans)

    def median(self, measure: Callable[[Outcome], float]) -> float:
        """The median over the runs; NaN where none has the number."""
        found = spread(measure(each) for each in self.known)
        return found.median if found else math.nan


def outcome(run: Run) -> Outcome:
    """Judge a run; where the truth cannot be had, the run has no result."""
    try:
        found = placements_of(run)
    except InputError as error:
        return Outcome(replace(run, report=None, error=str(error)), Measured(), None)
    return Outcome(run, measured(run), found)


def rows(found: Mapping[str, Sequence[Run]], keys: Iterable[str]) -> list[Row]:
    """The runs of some experiments, a row for each combination of the values of `keys`."""
    groups: dict[tuple[str, tuple[str, ...]], list[Outcome]] = {}
    for experiment, runs in found.items():
        for run in runs:
            values = tuple(run.value(key) for key in keys)
            groups.setdefault((experiment, values), []).append(outcome(run))
    return [Row(name, values, tuple(each)) for (name, values), each in groups.items()]


def confidences(row: Row, kind: str) -> str:
    """The least and the greatest confidence in the scans of a kind; nothing where there is none."""
    values: list[float] = []
    for each in row.known:
        names = {getattr(scan, "scan", scan) for scan in getattr(each.scans, kind)}
        for scan in (each.run.report or {}).get("scans", []):
            value = (scan.get("assessment") or {}).get("confidence")
            if scan["name"] in names and value is not None:
                values.append(value)
    return f"{min(values):.3f} to {max(values):.3f}" if values else ""


def ambiguous(row: Row) -> str:
    """Of how many scans without a place the reason says that the pose is ambiguous."""
    count = 0
    for each in row.known:
        reasons = {s["name"]: s.get("reason") for s in (each.run.report or {}).get("scans", [])}
        left = each.scans.left if each.scans else ()
        count += sum("ambiguous" in (reasons.get(name) or "") for name in left)
    return str(count) if count else ""


def starred(row: Row, value: float, form: str) -> str:
    """A median of errors, with a star where scans are not in the reference's frame."""
    text = number(value, form)
    return text if not text or all(each.now.complete for each in row.known) else f"{text}\\*"


def jobs(row: Row) -> str:
    """How many runs there are, and how many of them have a result."""
    total, there = len(row.outcomes), len(row.known)
    return str(total) if there == total else f"{there} of {total}"


def counted(kind: str) -> Callable[[Row], str]:
    """How many scans there are of a kind, nothing where nothing was run."""
    return lambda row: str(row.count(kind)) if row.known else ""


#: The heading of the times.
SECONDS = "time (s)"
COLUMNS: Mapping[str, Callable[[Row], str]] = {
    "runs": jobs,
    "scans": lambda row: str(row.total) if row.known else "",
    "correct": counted("right"),
    "false positives": counted("false"),
    "not placed": counted("left"),
    "ambiguous": ambiguous,
    "pairs / N": lambda row: number(row.median(lambda each: each.pairs_per_scan), ".2f"),
    "e_R": lambda row: starred(row, row.median(lambda each: each.now.rotation), ".4f"),
    "e_t (mm)": lambda row: starred(row, row.median(lambda each: each.now.translation), ".3f"),
    SECONDS: lambda row: number(row.median(lambda each: each.now.seconds), ".1f"),
    "confidence": lambda row: confidences(row, "right"),
    "of the false": lambda row: confidences(row, "false"),
}


def table(
    found: Sequence[Row], captions: Mapping[str, str], heads: Sequence[str], errors: bool,
    timed: bool = False,
) -> list[str]:  # fmt: skip
    """A Markdown table with a line for each row; columns without anything are left out.

    Parameters
    ----------
    found : sequence of Row
    captions : mapping
        What each experiment is, in words; the first column where there are several.
    heads : sequence of str
        Of the labels' columns.
    errors : bool
        Whether errors of the poses mean something: not where scans are of several objects.
    timed : bool
        Whether times are shown.
    """
    columns: dict[str, list[str]] = {}
    if len(captions) > 1:
        columns["scans of"] = [captions[row.experiment] for row in found]
    for index, head in enumerate(heads):
        columns[head] = [row.values[index] for row in found]
    left = len(columns)
    wanted = {head: cell for head, cell in COLUMNS.items()
              if (errors or not head.startswith("e_")) and (timed or head != SECONDS)}  # fmt: skip
    for head, cell in wanted.items():
        cells = [cell(row) for row in found]
        if any(cells):
            columns[head] = cells
    return markdown(list(columns), list(zip(*columns.values(), strict=True)), left)


def false_placements(found: Sequence[Row]) -> list[str]:
    """Every false placement, by run and scan; says so where there is none."""
    lines = [
        f"- {row.experiment}, {' '.join(each.run.overrides)}: {scan}"
        for row in found
        for each in row.known
        for scan in (each.scans.false if each.scans else ())
    ]
    return lines or (["None."] if any(row.known for row in found) else [])


def gaps(found: Sequence[Row]) -> list[str]:
    """Why it is not known where the scans of runs ended: each reason once, with its runs."""
    named: dict[str, list[str]] = {}
    for row in found:
        for run in (each.run for each in row.outcomes if each.scans is None):
            name = " ".join(override.partition("=")[2] for override in run.overrides)
            reason = public(run.error or "no truth is known")
            named.setdefault(reason, []).append(f"{row.experiment} {name}")
    return [
        f"- {reason}: {'; '.join(names) if len(names) <= MOST_NAMED else f'{len(names)} runs'}"
        for reason, names in named.items()
    ]
