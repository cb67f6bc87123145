"""Where the numbers of a report come from: when, on what machine, at which commit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from experiments.common.runs import Run
from mvreg.report.provenance import CODE, git

REPOSITORY = Path(__file__).resolve().parents[2]


def sources(runs: Sequence[Run], repository: Path = REPOSITORY) -> list[str]:
    """Lines about the runs of a page; empty where there is none with a result."""
    reports = [run.report for run in runs if run.report is not None]
    if not reports:
        return []
    days = sorted({str(report.get("finished") or "?")[:10] for report in reports})
    when = days[0] if len(days) == 1 else f"{days[0]} to {days[-1]}"
    lines = [
        f"- Date: {when}",
        f"- Machine: {'; '.join(counted(machine(report) for report in reports))}",
        f"- Commit: {'; '.join(counted(commit(report) for report in reports))}",
        f"- Versions: {'; '.join(counted(versions(report) for report in reports))}",
    ]
    return lines + [f"- **Note**: {note}" for note in notes(reports, repository)]


def counted(values: Iterable[str]) -> list[str]:
    """The different values; where there are several, with the number of runs."""
    found = Counter(values)
    return [value if len(found) == 1 else f"{value} ({n} runs)" for value, n in found.items()]


def machine(report: Mapping[str, Any]) -> str:
    """CPU model, cores and threads."""
    known = report.get("machine")
    if not known:
        return "not known"
    return (
        f"{known['cpu']}, {known['cores']} cores, {known['threads']} threads a run, "
        f"{known['system']}"
    )


def commit(report: Mapping[str, Any]) -> str:
    """The commit of a run."""
    return str(report.get("commit") or "not known")


def versions(report: Mapping[str, Any]) -> str:
    """The versions of a run."""
    return ", ".join(f"{name} {version}" for name, version in report["versions"].items())


def notes(reports: Sequence[Mapping[str, Any]], repository: Path) -> list[str]:
    """What may keep the numbers from being those of this repository, or of each other."""
    found = []
    commits = sorted({commit(report) for report in reports})
    if len(commits) > 1:
        found.append("the runs are of several commits, so they may not compare")
    if len({machine(report) for report in reports}) > 1:
        found.append("the runs are of several machines or numbers of threads; times do not compare")
    for each in commits:
        if each == "not known":
            found.append("some runs do not know their commit")
        elif each.endswith("-changed"):
            found.append(f"the code had changes that commit {each.partition('-')[0]} lacks")
        elif differs(each, repository):
            found.append(f"the code has changed since commit {each}, at which these runs were made")
    return found


def differs(then: str, repository: Path) -> bool:
    """Whether the code of the working tree is another than that of a commit, as far as is known."""
    return git(repository, "diff", "--quiet", then, "--", *CODE) is None
