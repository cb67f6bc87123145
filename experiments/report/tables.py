"""Tables in Markdown: a row per job, ours beside the printed figures, reasons for gaps."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from experiments.common.runs import Run
from experiments.report.measured import Measured, measured
from experiments.report.printed import Printed
from mvreg.report.comparison.formats import markdown

PATH = re.compile(r"(?<![\w/:.])~?(?:/[\w.+~-]+){2,}/?")


@dataclass(frozen=True)
class Job:
    """A row: a run, what it measured, what the paper prints; and both of what times refer to."""

    run: Run
    now: Measured
    printed: Printed | None
    base: Measured
    base_printed: Printed | None


@dataclass(frozen=True)
class Column:
    """A heading, and what stands below it."""

    head: str
    cell: Callable[[Job], str]


def jobs(
    runs: Sequence[Run],
    keys: Sequence[str],
    base: Mapping[str, str],
    printed: Callable[[Run], Printed | None],
) -> list[Job]:
    """The rows of a table.

    Parameters
    ----------
    runs : sequence of Run
    keys : sequence of str
        What the rows are sorted by, each in the order in which its values come in.
    base : mapping
        What the job that times refer to sets otherwise: ``{"method": "fcpma"}``.
    printed : callable
        The printed figures of a run, None where there are none.
    """
    orders = [list(dict.fromkeys(run.value(key) for run in runs)) for key in keys]
    rows = sorted(
        runs, key=lambda run: [o.index(run.value(k)) for k, o in zip(keys, orders, strict=True)]
    )
    known = {identity(run): run for run in runs}
    found = []
    for run in rows:
        other = known.get(identity(run, base))
        then, theirs = (measured(other), printed(other)) if other else (Measured(), None)
        found.append(Job(run, measured(run), printed(run), then, theirs))
    return found


def identity(run: Run, base: Mapping[str, str] | None = None) -> frozenset[tuple[str, str]]:
    """What tells a run from others; with `base`, what tells the run that it is compared with."""
    given = dict(override.lstrip("+").split("=", 1) for override in run.overrides)
    return frozenset({**given, **(base or {})}.items())


def mean_overlap(run: Run) -> float:
    """Mean over the placed scans of the share of each that the trimming kept; NaN if unknown."""
    rows = (run.report or {}).get("scans", [])
    found = [row["overlap"] for row in rows if row["status"] == "placed" and row["overlap"]]
    return sum(found) / len(found) if found else math.nan


def model_points(run: Run) -> float:
    """How many points the merged model has; NaN where there is none."""
    points = (run.report or {}).get("model_points")
    return math.nan if points is None else float(points)


def number(value: float | None, form: str) -> str:
    """A number, or nothing where there is none."""
    return "" if value is None or not math.isfinite(value) else format(value, form)


def mean_error(job: Job, value: float, form: str) -> str:
    """A mean error; with a star where it is one of some scans only."""
    text = number(value, form)
    return text if job.now.complete or not text else f"{text}\\*"


def ratio(ours: float, theirs: float | None) -> str:
    """How often ours is theirs."""
    return number(ours / theirs, ".2f") if theirs else ""


def time_ratio(ours: Printed | None, base: Printed | None) -> str:
    """How often one printed time is another."""
    if not (ours and base and ours.minutes and base.minutes):
        return ""
    return ratio(ours.minutes, base.minutes)


COLUMNS = (
    Column(
        "placed", lambda j: f"{j.now.placed} of {j.now.total}" if j.now.total else f"*{j.now.word}*"
    ),
    Column("false", lambda j: number(j.now.false, "d")),
    Column("pairs", lambda j: number(j.now.pairs, ".0f")),
    Column("e_R", lambda j: mean_error(j, j.now.rotation, ".4f")),
    Column("printed e_R", lambda j: number(j.printed and j.printed.rotation, ".4f")),
    Column("ratio", lambda j: ratio(j.now.rotation, j.printed and j.printed.rotation)),
    Column("e_t (mm)", lambda j: mean_error(j, j.now.translation, ".3f")),
    Column("printed e_t", lambda j: number(j.printed and j.printed.translation, ".4f")),
    Column("ratio", lambda j: ratio(j.now.translation, j.printed and j.printed.translation)),
    Column("time (s)", lambda j: number(j.now.seconds, ".1f")),
    Column("time ratio", lambda j: ratio(j.now.seconds, j.base.seconds)),
    Column("printed time ratio", lambda j: time_ratio(j.printed, j.base_printed)),
    Column("consistency", lambda j: number(j.now.consistency, ".3f")),
    Column("overlap", lambda j: number(mean_overlap(j.run), ".2f")),
    Column("model points", lambda j: number(model_points(j.run), ".0f")),
)


def table(rows: Sequence[Job], labels: Mapping[str, str], timed: bool = True) -> list[str]:
    """The table of some jobs: what each sets, then `COLUMNS`; those with nothing are left out.

    Parameters
    ----------
    rows : sequence of Job
    labels : mapping of str to str
        The overrides that tell the rows apart, and their headings.
    timed : bool
        Whether the times are of interest.
    """
    keys = [Column(head, lambda j, key=key: j.run.value(key)) for key, head in labels.items()]  # type: ignore[misc]
    heads, columns = [c.head for c in keys], [[c.cell(j) for j in rows] for c in keys]
    for column in COLUMNS:
        cells = [column.cell(job) for job in rows]
        if any(cells) and (timed or not column.head.startswith("time")):
            heads.append(column.head)
            columns.append(cells)
    return markdown(heads, list(zip(*columns, strict=True)), left=len(keys) + 1)


def gaps(rows: Sequence[Job]) -> list[str]:
    """Why rows are empty: each reason once, with the jobs that it is the reason of."""
    reasons: dict[str, list[str]] = {}
    for job in rows:
        if job.run.error is not None:
            name = " ".join(override.partition("=")[2] for override in job.run.overrides)
            reasons.setdefault(public(job.run.error), []).append(name)
    return [
        f"- {reason}: {'all' if len(names) == len(rows) else ', '.join(names)}"
        for reason, names in reasons.items()
    ]


def public(message: str) -> str:
    """The first line of a message, without the paths of the machine that it comes from."""
    return PATH.sub("(a folder)", message.splitlines()[0] if message else "no message")
