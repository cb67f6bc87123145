"""The quantities of a run that tables, figures and claims are made of."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from experiments.common.runs import Run
from mvreg.report.comparison.runs import values_of


@dataclass(frozen=True)
class Measured:
    """One run: pairs attempted, run time in seconds, and scans placed of `total`.

    `rotation` and `translation` are e_R and e_t, `consistency` is in resolutions, `false` counts
    the false positives, None where that is not known.

    Missing values are NaN; `word` then gives the reason in two or three words.
    """

    pairs: float = math.nan
    seconds: float = math.nan
    rotation: float = math.nan
    translation: float = math.nan
    consistency: float = math.nan
    false: int | None = None
    placed: int = 0
    total: int = 0
    word: str = "not run"

    @property
    def complete(self) -> bool:
        """Whether every scan was placed."""
        return self.total > 0 and self.placed == self.total


def measured(run: Run) -> Measured:
    """The quantities in a run's report."""
    report = run.report
    if report is None:
        return Measured(word=reason(run.error))
    values = values_of(report)
    known = {name: math.nan if value is None else value for name, value in values.items()}
    apart = sum(len(each["poses"]) for each in report.get("components", []))
    return Measured(
        pairs=known["attempts"],
        seconds=known["time"],
        rotation=known["e_R"],
        translation=known["e_t"],
        consistency=known["consistency_resolutions"],
        false=None if values["false"] is None else int(values["false"]),
        placed=len(report["poses"]),
        total=len(report["poses"]) + apart + len(report["unregistered"]),
        word="",
    )


def reason(error: str | None) -> str:
    """A run's error, shortened to fit a panel."""
    known = (
        "not on this machine", "not installed", "is not registered", "interrupted", "cut short",
        "not run",
    )  # fmt: skip
    found = next((words for words in known if words in (error or "")), "failed")
    return "not installed" if found == "is not registered" else found


def by_dataset(runs: Iterable[Run]) -> dict[str, dict[str, Run]]:
    """The jobs of a table: first data sets, then methods, both in the order they come in.

    Of several jobs of one method and data set the first counts, the one that was planned.
    """
    table: dict[str, dict[str, Run]] = {}
    for run in runs:
        methods = table.setdefault(run.value("dataset"), {})
        methods.setdefault(run.value("method"), run)
    return table
