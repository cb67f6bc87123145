"""The report of a run under way: what is placed by now, not judged, so that it costs little."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from mvreg.evaluation.records import Assessment
from mvreg.report.deciding_pair import component_of
from mvreg.report.input_rows import input_row
from mvreg.report.json_file import SCHEMA, to_plain
from mvreg.report.pair_rows import pair_rows
from mvreg.report.provenance import provenance
from mvreg.report.rows import Row, scan_row
from mvreg.types import Result, ScanSet, View

#: What is known of a link at the end only.
MEASURED = (
    "rms", "rms_resolutions", "adjusted_points", "adjusted_rms", "p95", "weakest_axis",
    "weakest_sigma", "covariance", "uncertainty",
)  # fmt: skip


def report_so_far(
    scanset: ScanSet,
    views: Sequence[View],
    result: Result,
    *,
    method: str,
    seconds: Mapping[str, float],
) -> dict[str, object]:
    """What there is to show of a run under way; for the page, ``result.json`` comes at the end.

    Grades, residuals, errors and loops take as long as tens of pairs, and the poses that they are
    of may still change: they are left out. Links are the pairs that were accepted.

    Parameters
    ----------
    scanset, views, result
        What went in, what was prepared, and what is placed by now.
    method : str
        The method's name.
    seconds : mapping
        Time by stage.

    Returns
    -------
    dict
        As `mvreg.report.build.build_report`; its `status` is "running".
    """
    unjudged = Assessment(math.nan, {}, ())
    parts = enumerate(result.components, start=2)
    report = {
        "schema": SCHEMA,
        "status": "running",
        "method": method,
        "dataset": scanset.name,
        "rng": None,
        "unit": scanset.unit,
        "resolution": views[0].scale.resolution if views else None,
        "reference": result.reference,
        "poses": dict(result.poses),
        "components": [{"number": number, "poses": dict(poses)} for number, poses in parts],
        "unregistered": list(result.unregistered),
        "num_pairs": len(result.pairs),
        "seconds": dict(seconds),
        "errors": None,
        "consistency": None,
        "grades": None,
        "scans": [scan_row(scan.name, result, {}, unjudged) for scan in scanset.scans],
        "links": _accepted(result),
        "loops": [],
        "pairs": pair_rows(result.pairs),
        "input": input_row(scanset.input, scanset.scans),
        "remarks": list(scanset.remarks),
        "config": {},
        **provenance(),
    }
    plain: dict[str, object] = to_plain(report)
    return plain


def _accepted(result: Result) -> list[Row]:
    """The accepted pairs of scans that are placed in one model, as links."""
    numbers = component_of(result)
    return [
        {
            "source": pair.source,
            "target": pair.target,
            "component": numbers[pair.source],
            "confidence": pair.verdict.confidence,
            "contact_ratio": pair.overlap,
            **dict.fromkeys(MEASURED),
        }
        for pair in result.pairs
        if pair.verdict.reliable and numbers.get(pair.source, -1) == numbers.get(pair.target, -2)
    ]
