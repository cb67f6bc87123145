"""What the page says: the verdict in a sentence, what to do next, and doubts in plain words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mvreg.evidence.pooled import CONSISTENT
from mvreg.report.formatting import count

Report = Mapping[str, Any]
Row = Mapping[str, Any]
#: Statuses of scans without a pose.
LOST = ("not placed", "ambiguous")


def verdict(report: Report) -> str:
    """The outcome in one sentence."""
    rows = report.get("scans") or []
    parts = report.get("components") or []
    placed, total = len(report.get("poses") or {}), len(rows)
    doubtful = [row for row in rows if grade(row) in ("amber", "red")]
    if report.get("status") == "interrupted":
        said = f"Interrupted: {placed} of {count(total, 'scan')} were placed so far"
    elif report.get("status") == "running":
        said = f"Under way: {placed} of {count(total, 'scan')} are placed in one model so far"
    elif placed <= 1 < total and not parts:
        said = f"No two of the {total} scans are placed together"
    elif placed == total:
        said = f"All {count(total, 'scan')} are placed in one model"
    else:
        said = f"{placed} of {count(total, 'scan')} are placed in one model"
    if parts:
        apart = sum(len(part["poses"]) for part in parts)
        where = "in another part" if len(parts) == 1 else f"in {len(parts)} other parts"
        said += f", {apart} more {where}"
    lost = sum(row.get("status") in LOST for row in rows)
    together = placed > 1 or bool(parts) or total <= 1
    if lost and together and report.get("status") != "running":
        said += f", {lost} {'is' if lost == 1 else 'are'} not placed"
    if doubtful:
        said += f"; {len(doubtful)} of the poses {'is' if len(doubtful) == 1 else 'are'} doubtful"
    return said + "."


def next_steps(report: Report) -> list[str]:
    """What a person can do about it, most urgent first."""
    if report.get("status") == "running":
        return [
            "The run goes on, and poses may change: load this page again in a minute or more. "
            "Grades, residuals and loops come at its end."
        ]
    rows = report.get("scans") or []
    steps = []
    red = [str(row["name"]) for row in rows if grade(row) == "red"]
    if red:
        steps.append(
            f"Do not use the poses of {_listed(red)}, which their neighbours contradict: look at "
            "them below, leave these scans out or scan again there."
        )
    amber = [str(row["name"]) for row in rows if grade(row) == "amber"]
    if amber:
        steps.append(
            f"Look at {_listed(amber)} before you rely on them; the table of scans has the reason."
        )
    ambiguous = [str(row["name"]) for row in rows if row.get("status") == "ambiguous"]
    if ambiguous:
        steps.append(
            f"Several poses of {_listed(ambiguous)} fit as well as each other. Scans with "
            "something in them that is not symmetric, known sensors (dataset.sensor) or a known "
            "vertical (dataset.upright=true) may tell them apart. Look at each answer below."
        )
    apart = [row for row in rows if row.get("status") == "not placed"]
    lost = [str(row["name"]) for row in apart if row.get("attempts") or row.get("reason")]
    untried = [str(row["name"]) for row in apart if str(row["name"]) not in lost]
    if untried:
        steps.append(f"No pose is known of {_listed(untried)}, and none was looked for.")
    if lost:
        steps.append(
            f"For {_listed(lost)} no pose was certain enough. Compare the best ones below; a scan "
            "from between it and its neighbours helps most."
        )
    parts = report.get("components") or []
    if parts:
        steps.append(
            "Scans that overlap both parts would join them; each part has a model of its own "
            "beside model.ply."
        )
    return steps


def hint(report: Report) -> str | None:
    """What would make the page say more."""
    if report.get("unit") != "file":
        return None
    return (
        "Say dataset.unit=mm (or m, ...) to have the levels of accuracy named; nothing is "
        "converted."
    )


def grade(row: Row) -> str | None:
    """The grade of a placed scan: green, amber, red; None where there is none."""
    found = (row.get("assessment") or {}).get("grade")
    return str(found) if found else None


def doubt(row: Row, running: bool = False) -> str:
    """Why a scan is as it is, in plain words; of a run that is `running`, as far as is known."""
    status = str(row.get("status"))
    if running:
        unknown = "not tried yet" if status in LOST else "not judged yet"
        return str(row.get("reason") or unknown)
    if status in LOST:
        if not row.get("attempts") and not row.get("reason"):
            return "no attempt was made"
        said = str(row.get("reason") or "nothing to compare it with")
        return f"{count(row.get('attempts') or 0, 'attempt')}; the closest: {said}"
    found = row.get("assessment") or {}
    if not found:
        return "alone in its part"
    said = str(found.get("reason"))
    if grade(row) == "green" and found.get("reason") not in (None, CONSISTENT):
        said = f"certain in spite of an objection: {said}"
    if status == "reference":
        return f"its frame is the model's; {said}"
    return said


def importance(row: Row) -> tuple[int, float]:
    """A key that sorts scans: those not placed, the red, the amber, those apart, then the rest."""
    status, graded = str(row.get("status")), grade(row)
    order = ["red", "amber"]
    if status in LOST:
        rank = 0
    elif graded in order:
        rank = 1 + order.index(graded)
    else:
        rank = 3 if status.startswith("component") else 4
    confidence = (row.get("assessment") or {}).get("confidence")
    return rank, 1.0 if confidence is None else float(confidence)


def _listed(names: list[str]) -> str:
    shown = names[:5]
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    return ", ".join(shown) + more
