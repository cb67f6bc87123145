"""Build the report of a run: the dictionary that ``result.json`` holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import chain

from mvreg.evaluation.assess import assess
from mvreg.evaluation.pose_errors import consistency, result_errors
from mvreg.evaluation.survey import loop_closures, survey_links
from mvreg.report.input_rows import input_row
from mvreg.report.json_file import SCHEMA, to_plain
from mvreg.report.pair_rows import pair_rows
from mvreg.report.provenance import provenance
from mvreg.report.rows import (
    component_rows,
    consistency_row,
    errors_row,
    grade_row,
    link_rows,
    loop_rows,
    scan_row,
)
from mvreg.surface.largest_range import remark_on_largest_range
from mvreg.types import Pair, Result, ScanSet, View


def build_report(
    scanset: ScanSet,
    views: Sequence[View],
    result: Result,
    *,
    method: str,
    rng: int | None,
    seconds: Mapping[str, float],
    config: Mapping[str, object],
    interrupted: bool = False,
) -> dict[str, object]:
    """Everything that is to be remembered of a run.

    Parameters
    ----------
    scanset, views, result
        What went in, what was prepared, and what came out.
    method : str
        The method's name.
    rng : int or None
        The number that started the random generator.
    seconds : mapping
        Time by stage, and "load" and "total" (without loading and imports). What the pairs took
        per stage is added for the stages that it does not name.
    config : mapping
        The whole configuration, ready to run again.
    interrupted : bool
        The result is partial.

    Returns
    -------
    dict
        Only what JSON knows; numbers that are NaN or infinite have become None. Lengths are in
        `unit`, poses are ``T_model_scan``, row by row; `model_points` is the size of the merged
        view, None where the strategy keeps none. `status` is "complete" only if every scan has a
        pose in the reference's frame.
    """
    errors, apart = result_errors(result, scanset)
    by_scan = {name: e for each in (errors, *apart) if each for name, e in each.scans.items()}
    assessment = assess(result, views)
    surveyed = {
        number: survey_links(poses, views)
        for number, poses in enumerate((result.poses, *result.components), start=1)
    }
    resolution = views[0].scale.resolution if views else None
    complete = "incomplete" if result.unregistered or result.components else "complete"
    report = {
        "schema": SCHEMA,
        "status": "interrupted" if interrupted else complete,
        "method": method,
        "dataset": scanset.name,
        "rng": rng,
        "unit": scanset.unit,
        "resolution": resolution,
        "reference": result.reference,
        "poses": dict(result.poses),
        "components": component_rows(result, views, apart),
        "unregistered": list(result.unregistered),
        "num_pairs": len(result.pairs),
        "model_points": None if result.model is None else len(result.model.points),
        "seconds": {**pair_seconds(result.pairs), **seconds},
        "errors": errors_row(errors),
        "consistency": consistency_row(consistency(result.poses, views)),
        "grades": grade_row(assessment, resolution),
        "scans": [
            {**scan_row(scan.name, result, by_scan, assessment), "sensor": scanset.sensor_of(scan)}
            for scan in scanset.scans
        ],
        "links": link_rows(assessment, result, [*chain(*surveyed.values())], resolution, views),
        "loops": loop_rows({number: loop_closures(links) for number, links in surveyed.items()}),
        "pairs": pair_rows(result.pairs),
        "covariances": dict(result.covariances),
        "patterns": [asdict(pattern) for pattern in result.patterns],
        "scales": [asdict(scale) for scale in result.scales],
        "truth": None if scanset.poses is None else dict(scanset.poses),
        "objects": None if scanset.objects is None else dict(scanset.objects),
        "motions": dict(scanset.motions),
        "input": input_row(scanset.input, scanset.scans),
        "remarks": [
            *scanset.remarks,
            *remark_on_largest_range(scanset.scans),
            *assessment.remarks,
            *map(str, result.patterns),
            *(str(scale) for scale in result.scales if scale.off),
        ],
        "config": dict(config),
        **provenance(),
    }
    plain: dict[str, object] = to_plain(report)
    return plain


def pair_seconds(pairs: Sequence[Pair]) -> dict[str, float]:
    """Time by stage, summed over the pairs."""
    total: dict[str, float] = {}
    for pair in pairs:
        for stage, seconds in pair.seconds.items():
            total[stage] = total.get(stage, 0.0) + seconds
    return total
