"""What was read for a run: the rows of the report, and what is said of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mvreg.report.formatting import count, unit_name
from mvreg.types import Finding, Input, Scan, ScanSet
from mvreg.types.figures import significant

Row = dict[str, object]
#: So many sentences are said when a run starts.
MOST = 5


def input_row(found: Input | None, scans: Sequence[Scan]) -> Row | None:
    """What a folder held; None where there is no folder."""
    if found is None:
        return None
    return {
        "files": found.files,
        "left_out": [{"name": name, "reason": why} for name, why in found.left_out.items()],
        "scans": [scan_input(scan) for scan in scans],
        "findings": [finding_row(each) for each in found.findings],
    }


def scan_input(scan: Scan) -> Row:
    """What a scan holds."""
    return {
        "name": scan.name,
        "points": number_of_points(scan),
        "extent": np.ptp(scan.points, axis=0),
        "attributes": attributes_of(scan),
    }


def number_of_points(scan: Scan) -> int:
    """All points of a scan, also where only some are held."""
    return len(scan.points) if scan.full is None else scan.full.count


def attributes_of(scan: Scan) -> list[str]:
    """The names of a scan's attributes."""
    return list(scan.attributes if scan.full is None else scan.full.kinds)


def finding_row(finding: Finding) -> Row:
    """One finding, as the report has it."""
    return {
        "kind": finding.kind, "scans": list(finding.scans), "text": finding.text,
        "advice": finding.advice,
    }  # fmt: skip


def said(finding: Mapping[str, Any] | Row) -> str:
    """A finding and what to do about it, in one line."""
    return f"{finding['text']}; {finding['advice']}"


def what_was_read(scanset: ScanSet) -> str:
    """One line: how many files, scans and points, how large, with what attributes."""
    scans = scanset.scans
    parts = [count(len(scans), "scan")]
    if scanset.input is not None:
        parts[0] += f" from {count(scanset.input.files, 'file')}"
    parts.append(f"{sum(map(number_of_points, scans)):,} points")
    spans = [float(np.ptp(scan.points, axis=0).max()) for scan in scans]
    low, high = significant(min(spans, default=0)), significant(max(spans, default=0))
    unit = unit_name(scanset.unit)
    parts.append(f"{low} to {high} {unit} across" if low != high else f"{low} {unit} across")
    names = dict.fromkeys(name for scan in scans for name in attributes_of(scan))
    if names:
        parts.append(f"with {', '.join(list(names)[:6])}{' and more' * (len(names) > 6)}")
    return "; ".join(parts)


def opening_lines(scanset: ScanSet) -> list[str]:
    """What is said of a folder before its scans are registered; nothing of other data sets."""
    if scanset.input is None:
        return []
    notes = [said(finding_row(each)) for each in scanset.input.findings] + [*scanset.remarks]
    lines = [f"read {what_was_read(scanset)}", *(f"note: {note}" for note in notes[:MOST])]
    if len(notes) > MOST:
        lines.append(f"and {count(len(notes) - MOST, 'more note')}: mvreg look shows all")
    return lines
