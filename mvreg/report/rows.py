"""The parts of a report: a row per scan, per pair, per link and per partial model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from mvreg.evaluation.grade import (
    AMBER_CONFIDENCE,
    GREEN_CONFIDENCE,
    GREEN_COVERAGE,
    GREEN_INLIER_RATIO,
    GREEN_STRENGTH,
)
from mvreg.evaluation.pose_errors import Consistency, PoseErrors, ScanError, consistency
from mvreg.evaluation.records import Assessment, LinkAssessment, ScanAssessment, Uncertainty
from mvreg.evaluation.survey import LinkSurvey, LoopClosure
from mvreg.geometry import se3
from mvreg.report.deciding_pair import component_of, deciding_pair, joining_pair, reason_of
from mvreg.report.pair_rows import AMBIGUOUS, told_answers
from mvreg.types import Array, Link, Pair, Result, View

Row = dict[str, object]


def scan_row(
    name: str, result: Result, errors: Mapping[str, ScanError], assessment: Assessment
) -> Row:
    """What there is to say of one scan."""
    number = component_of(result).get(name)
    first = {next(iter(poses), None) for poses in result.components} | {result.reference}
    pair = None if name in first else deciding_pair(name, result)
    mse = pair.trimmed_mse if pair else None
    error, found = errors.get(name), assessment.scans.get(name)
    return {
        "name": name,
        "status": _status(name, number, result, pair),
        "component": number,
        "attempts": sum(other.source == name for other in result.pairs),
        "overlap": pair.overlap if pair else None,
        "trimmed_rmse": math.sqrt(mse) if mse is not None else None,
        "reason": reason_of(pair, placed=number is not None),
        "pair_confidence": pair.verdict.confidence if pair else None,
        "answers": told_answers(pair, placed=number is not None),
        "assessment": assessment_row(found) if found else None,
        "errors": error_row(error) if error else None,
    }


def _status(name: str, number: int | None, result: Result, pair: Pair | None) -> str:
    if number is None:
        ambiguous = pair is not None and pair.verdict.reason.startswith(AMBIGUOUS)
        return AMBIGUOUS if ambiguous else "not placed"
    if number > 1:
        return f"component {number}"
    return "reference" if name == result.reference else "placed"


def assessment_row(found: ScanAssessment) -> Row:
    """What is said of a placed scan without a truth; lengths in the scans' unit."""
    off = found.uncertainty
    return {
        "grade": found.grade.value if found.grade else None,
        "confidence": found.confidence,
        "reason": found.reason,
        "coverage": found.coverage,
        "inlier_ratio": found.inlier_ratio,
        "rms": found.rms,
        "strength": list(found.strength),
        "uncertainty": uncertainty_row(off) if off else None,
    }


def link_rows(
    assessment: Assessment,
    result: Result,
    surveyed: Sequence[LinkSurvey],
    resolution: float | None,
    views: Sequence[View],
) -> list[Row]:
    """The pairs of placed scans that overlap; with what an adjustment rests on, where it tells."""
    found = {frozenset((link.source, link.target)): link for link in surveyed}
    poses = {
        name: pose for model in (result.poses, *result.components) for name, pose in model.items()
    }
    points = {view.name: view.points for view in views}
    adjusted = dict[frozenset[str], list[Link]]()
    for link in result.links:
        adjusted.setdefault(frozenset((link.source, link.target)), []).append(link)
    rows = []
    for one in assessment.links:
        pair = frozenset((one.source, one.target))
        links = adjusted.get(pair, [])
        row = _link_row(one, links, found.get(pair), resolution)
        rows.append(row | _relative_rows(one, links, poses, points))
    return rows


def _relative_rows(
    link: LinkAssessment,
    adjusted: Sequence[Link],
    poses: Mapping[str, Array],
    points: Mapping[str, Array],
) -> Row:
    """How certain the pose of the source is relative to the target, where that is told."""
    if not adjusted:
        return {"covariance": None, "uncertainty": None}
    pose = se3.invert(poses[link.target]) @ poses[link.source]
    same = next((other for other in adjusted if other.source == link.source), None)
    told = same.covariance if same else adjusted[0].covariance_back(se3.invert(pose))
    if told is None:
        return {"covariance": None, "uncertainty": None}
    off = Uncertainty.of(told, pose, points[link.source])
    return {"covariance": told, "uncertainty": uncertainty_row(off)}


def uncertainty_row(off: Uncertainty) -> Row:
    """How far a pose may be off, by its covariance."""
    return {
        "angle_deg": off.rotation, "translation": off.translation, "axes_95": list(off.axes_95),
    }  # fmt: skip


def _link_row(
    link: LinkAssessment,
    adjusted: Sequence[Link],
    survey: LinkSurvey | None,
    resolution: float | None,
) -> Row:
    points = sum(other.points for other in adjusted)
    squares = sum(other.points * other.rms**2 for other in adjusted)
    return {
        "source": link.source,
        "target": link.target,
        "component": link.component,
        "confidence": link.confidence,
        "contact_ratio": link.contact_ratio,
        "rms": link.rms,
        "rms_resolutions": link.rms / resolution if resolution else None,
        "adjusted_points": points if adjusted else None,
        "adjusted_rms": math.sqrt(squares / points) if points else None,
        "p95": survey.p95 if survey else None,
        "weakest_axis": survey.weakest_axis.tolist() if survey else None,
        "weakest_sigma": survey.weakest_sigma if survey else None,
    }


def loop_rows(loops: Mapping[int, Sequence[LoopClosure]]) -> list[Row]:
    """Loops of links by the number of their partial model, the worst of each first."""
    return [
        {"component": number, "scans": list(loop.names), "angle_deg": loop.angle,
         "translation": loop.translation}
        for number, found in loops.items()
        for loop in found
    ]  # fmt: skip


def component_rows(
    result: Result, views: Sequence[View], errors: Sequence[PoseErrors | None]
) -> list[Row]:
    """The partial models other than the reference's, numbered from 2.

    Each has poses, errors and consistency of its own, in the frame of its first scan, and the
    reason of the attempt that came closest to joining it to any other.
    """
    rows: list[Row] = []
    for number, (poses, error) in enumerate(zip(result.components, errors, strict=True), start=2):
        pair, attempts = joining_pair(poses, result)
        rows.append({
            "number": number,
            "reference": next(iter(poses), None),
            "poses": dict(poses),
            "attempts": attempts,
            "reason": reason_of(pair, placed=False),
            "pair_confidence": pair.verdict.confidence if pair else None,
            "answers": told_answers(pair, placed=False),
            "errors": errors_row(error),
            "consistency": consistency_row(consistency(poses, views)),
        })  # fmt: skip
    return rows


def grade_row(assessment: Assessment, resolution: float | None) -> Row:
    """What the grades mean: least values of a green scan, and of an amber one's confidence."""
    return {
        "tolerance": assessment.tolerance,
        "tolerance_resolutions": assessment.tolerance / resolution if resolution else None,
        "confidence": GREEN_CONFIDENCE,
        "coverage": GREEN_COVERAGE,
        "inlier_ratio": GREEN_INLIER_RATIO,
        "strength": GREEN_STRENGTH,
        "amber_confidence": AMBER_CONFIDENCE,
    }


def error_row(error: ScanError) -> dict[str, float]:
    """One pose's distance from the truth."""
    return {
        "rotation": error.rotation,
        "angle_deg": error.angle,
        "translation": error.translation,
    }


def errors_row(errors: PoseErrors | None) -> Row | None:
    """The distances from the truth of all the poses in one frame."""
    if errors is None:
        return None
    return {
        "frame": errors.frame,
        "mean": error_row(errors.mean),
        "max": error_row(errors.max),
        "scans": {name: error_row(error) for name, error in errors.scans.items()},
    }


def consistency_row(found: Consistency | None) -> Row | None:
    """How the surfaces lie on each other."""
    if found is None:
        return None
    return {
        "median": found.median,
        "rms": found.rms,
        "median_resolutions": found.relative_median,
        "rms_resolutions": found.relative_rms,
        "points": found.points,
        "pairs": found.pairs,
    }
