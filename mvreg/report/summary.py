"""The lines below the table: legend, errors, times, and what was not joined."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mvreg.report.formatting import confidence, count, length, number, unit
from mvreg.report.input_rows import said

if TYPE_CHECKING:
    from rich.text import Text

Report = Mapping[str, Any]
Lines = list["str | Text"]
#: Who told where a sensor was, in words; reports of data sets that know it all say nothing.
SENSORS = {
    "file": "told by the file", "user": "told by dataset.sensor",
    "data set": "told by the data set", "unknown": "unknown",
}  # fmt: skip


def totals(report: Report, folder: Path | None = None) -> Lines:
    """All the lines, in order."""
    from rich.text import Text

    lines: Lines = [Text(line, style="dim") for line in _legend(report)]
    lines.append("")
    lines += [Text(f"remark: {remark}", style="yellow") for remark in report.get("remarks") or []]
    if report.get("status") != "complete":
        found = (report.get("input") or {}).get("findings") or []
        lines += [Text(f"input: {said(each)}", style="bold yellow") for each in found]
    if report.get("status") == "interrupted":
        lines.append(Text("interrupted: this is what was finished", style="bold red"))
    lines += _sensor_line(report)
    lines.append(_placed_line(report))
    lines += _error_line("", report, report)
    for part in report.get("components") or []:
        lines += _error_line(f"component {part['number']}: ", part, report)
    lines += _consistency_lines(report)
    lines += _relative_lines(report)
    lines += [Text(line, style="red") for line in _doubts(report) + _left_over(report)]
    return lines + (_folder_lines(folder) if folder else [])


def _legend(report: Report) -> list[str]:
    limits = report.get("grades")
    if not limits:
        return []
    near = f"{length(limits['tolerance'], report)} {unit(report)}"
    return [
        "",
        f"green: confidence {limits['confidence']:.2f}, coverage {limits['coverage']:.2f}, "
        f"inlier ratio {limits['inlier_ratio']:.2f}, weakest axis {limits['strength']:.2f} or more",
        f"RED: confidence below {limits['amber_confidence']:.2f}; "
        "covered: share of the scan's points in contact with others (coverage)",
        f"inlier ratio: share of these within {near} of the other scan's tangent plane",
        "weakest axis: strength of the overlap along it, from 0 (free to slide) to 1",
    ]


def _sensor_line(report: Report) -> list[str]:
    """Of how many scans who told where the sensor was, where it is not the data set alone."""
    found = [str(row["sensor"]) for row in report.get("scans", []) if row.get("sensor")]
    if set(found) <= {"data set"}:
        return []
    parts = [
        f"{words} for {count(found.count(who), 'scan')}"
        for who, words in SENSORS.items()
        if who in found
    ]
    return [f"sensor {', '.join(parts)}"]


def _placed_line(report: Report) -> str:
    seconds = report.get("seconds") or {}
    parts = report.get("components") or []
    apart = sum(len(part["poses"]) for part in parts)
    others = f" ({apart} more in {count(len(parts), 'other component')})" if parts else ""
    return (
        f"placed {len(report.get('poses', {}))} of {len(report.get('scans', []))} scans{others} "
        f"with {report.get('num_pairs', 0)} pairs in {number(seconds.get('total'), '.2f')} s "
        f"(loading {number(seconds.get('load'), '.2f')} s)"
    )


def _error_line(start: str, part: Report, report: Report) -> list[str]:
    """Errors of the poses in one frame; lengths in the unit of `report`."""
    errors = part.get("errors")
    if not errors:
        return []
    mean, most = errors["mean"], errors["max"]
    line = (
        f"{start}e_R {number(mean['rotation'], '.4f')} (max {number(most['rotation'], '.4f')}), "
        f"e_t {length(mean['translation'], report)} {unit(report)} "
        f"(max {length(most['translation'], report)} {unit(report)})"
    )
    if errors.get("frame") != part.get("reference"):
        line += f", in the frame of {errors.get('frame')}: the reference has no ground truth"
    return [line]


def _consistency_lines(report: Report) -> list[str]:
    found = report.get("consistency")
    if not found:
        return []
    return [
        f"consistency: point-to-plane median {length(found['median'], report)}, "
        f"RMS {length(found['rms'], report)} {unit(report)} "
        f"({number(found['median_resolutions'], '.3f')} and "
        f"{number(found['rms_resolutions'], '.3f')} resolutions)"
    ]


def _relative_lines(report: Report) -> list[str]:
    """How certain the relative poses of linked scans are, in the middle and at worst."""
    found = [link for link in report.get("links") or [] if link.get("uncertainty")]
    if not found:
        return []
    found.sort(key=lambda link: float(link["uncertainty"]["translation"]))
    middle, worst = found[len(found) // 2]["uncertainty"], found[-1]
    return [
        f"relative poses of linked scans: +-{length(middle['translation'], report)} "
        f"{unit(report)} and {number(middle['angle_deg'], '.4f')} deg in the median, "
        f"+-{length(worst['uncertainty']['translation'], report)} {unit(report)} at most, of "
        f"{worst['source']} and {worst['target']}"
    ]


def _doubts(report: Report) -> list[str]:
    """The objections to the poses graded red."""
    found = [(row.get("name"), row.get("assessment") or {}) for row in report.get("scans", [])]
    return [
        f"{name} is RED: {said['reason']}" for name, said in found if said.get("grade") == "red"
    ]


def _left_over(report: Report) -> list[str]:
    """What could not be joined, and why not."""
    lines = []
    for part in report.get("components") or []:
        lines.append(f"component {part['number']} was not joined to the first: {_tried(part)}")
        lines += _answers(part, report)
    for row in report.get("scans", []):
        if row.get("status") in ("not placed", "ambiguous"):
            lines.append(f"{row.get('name')} was not placed: {_tried(row)}")
            lines += _answers(row, report)
    return lines


def _answers(found: Report, report: Report) -> list[str]:
    """The poses that are about as probable as each other, with what each is given."""
    told = found.get("answers")
    if not told:
        return []
    first, *others = told["poses"]
    said = [
        f"{confidence(one['confidence'])} for {number(one['angle_deg'], '.1f')} deg and "
        f"{length(one['apart'], report)} {unit(report)} (RMS) from there"
        for one in others
    ]
    return [
        f"  {count(len(told['poses']), 'pose')} of {told['source']} on {told['target']} are left: "
        f"confidence {confidence(first['confidence'])}; {'; '.join(said)}"
    ]


def _tried(found: Report) -> str:
    attempts = count(found.get("attempts", 0), "attempt")
    if not found.get("reason"):
        return attempts
    known = found.get("pair_confidence")
    sure = "" if known is None else f" (confidence {confidence(known)})"
    return f"{attempts}; the closest{sure}: {found['reason']}"


def _folder_lines(folder: Path) -> list[str]:
    here = Path.cwd()
    shown = folder.relative_to(here) if folder.is_relative_to(here) else folder
    lines = [f"written to {shown}"]
    if (folder / "report.html").exists():
        lines.append(f"open the report in a browser: {shlex.quote(str(shown / 'report.html'))}")
    if (folder / "run.rrd").exists():
        lines.append(f"see it with: rerun {shlex.quote(str(shown / 'run.rrd'))}")
    return lines
