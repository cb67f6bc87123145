"""Confidence and grade of every placed scan; needs no ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from mvreg.errors import InputError
from mvreg.evaluation.component import ComponentEvidence, Names
from mvreg.evaluation.grade import Grade, grade
from mvreg.evaluation.records import Assessment as Assessment
from mvreg.evaluation.records import LinkAssessment as LinkAssessment
from mvreg.evaluation.records import ScanAssessment as ScanAssessment
from mvreg.evaluation.records import Uncertainty as Uncertainty
from mvreg.evaluation.still import STOOD_STILL, stood_still
from mvreg.evidence.pooled import pool_evidence
from mvreg.parallel import in_threads
from mvreg.surface.contact import Contact, axis_strength, surface_spacing
from mvreg.surface.largest_range import without_largest_range
from mvreg.surface.overlap import sampled
from mvreg.types import Array, Result, Scan, Scans, ScanSet, View
from mvreg.types.given import as_scans

#: Point-to-plane distances up to this are within tolerance (resolutions). Of the overlapping points
#: of the Bunny, Dragon and Buddha scans 82 to 92 per cent are, at their true poses; of a scan
#: that is turned by one degree 35 to 82 per cent, by two degrees at most 65.
TOLERANCE = 0.5
#: Or up to so many noise floors of the scans, if that is more. With noise of 0.25, 0.5 and 1
#: resolutions added to the Bunny and the Dragon 81 to 89 per cent are within, at their true poses.
NOISES = 2.0
#: Pairs of which neither scan has so much of its points on the other tell too little to be listed.
LEAST_CONTACT_RATIO = 0.1


#: What `assess` may be given of what was registered.
Given = Sequence[View] | Scans


def assess(result: Result, views: Given | None = None) -> Assessment:
    """Say how far the poses of a result are to be trusted, by the scans alone.

    Every partial model is looked at by itself. Only scans whose bounding boxes overlap are
    compared, and at most a thousand points of each, evenly from its list. No scan is green in a
    partial model of scans whose sensor stood still, see `mvreg.evaluation.still.stood_still`.

    Parameters
    ----------
    result : Result
    views : sequence of View or of scans, or ScanSet, optional
        What was registered. The views that `mvreg.register` leaves in the result are used if
        nothing is given, or the same scans; for poses of another origin, pass what
        `mvreg.prepare` makes of the scans.

    Returns
    -------
    Assessment

    Raises
    ------
    InputError
        If a placed scan is not among the scans, or scans are given that are not those of which the
        result has the views.
    """
    prepared = _prepared(result, views)
    models = (result.poses, *result.components)
    parts = [
        ComponentEvidence.of(number, poses, prepared, result.pairs)
        for number, poses in enumerate(models, start=1)
    ]
    tolerance = _tolerance(parts)
    still = [stood_still(part) for part in parts]
    scans: dict[str, ScanAssessment] = {}
    for part, doubtful in zip(parts, still, strict=True):
        for view in part.views:
            found = _scan(view, part, tolerance, result.covariances.get(view.name))
            scans[view.name] = _doubted(found) if doubtful else found
    resolution = prepared[0].scale.resolution if prepared else 0.0
    links = tuple(link for part in parts for link in _links(part))
    remarks = (STOOD_STILL,) if any(still) else ()
    return Assessment(tolerance * resolution, scans, links, remarks)


def _prepared(result: Result, given: Given | None) -> Sequence[View]:
    """The views to compare: those given, or the result's own."""
    views: Sequence[View] = result.views
    if given is not None:
        if not isinstance(given, ScanSet) and all(isinstance(each, View) for each in given):
            views = cast("Sequence[View]", given)
            if not views:  # none was prepared: nothing can be compared
                return views
        else:
            _check_same(as_scans(cast("Scans", given)), views)
    placed = [name for poses in (result.poses, *result.components) for name in poses]
    missing = sorted(set(placed) - {view.name for view in views})
    if missing:
        raise InputError(
            f"the result places {', '.join(missing)}, which is not among the prepared scans; "
            "expected the views of what was registered: mvreg.prepare(scans, method)"
        )
    return views


def _check_same(scans: Sequence[Scan], views: Sequence[View]) -> None:
    """Raise InputError unless these are the scans that the views were made of."""
    made = {view.name: view.scan for view in views}
    for scan in scans:
        own = made.get(scan.name)
        if own is None or not (own is scan or _same_points(own, scan)):
            raise InputError(
                f"scan {scan.name} is not one of those that the result has the views of"
                f"{'' if views else ' (it has none)'}; expected the scans that were registered, "
                "or views: mvreg.assess(result, mvreg.prepare(scans, method))"
            )


def _same_points(prepared: Scan, given: Scan) -> bool:
    """Whether a prepared scan has all points of the one given, or those that preparing leaves."""
    return np.array_equal(prepared.points, given.points) or np.array_equal(
        prepared.points, without_largest_range(given).points
    )


def _tolerance(parts: Sequence[ComponentEvidence]) -> float:
    """How far apart surfaces may be that lie on each other (resolutions)."""
    noise = [each.noise for part in parts for each in part.evidence.values() if each.points]
    return max(TOLERANCE, NOISES * float(np.median(noise))) if noise else TOLERANCE


def _links(part: ComponentEvidence) -> list[LinkAssessment]:
    """The pairs that overlap enough, each weighed by itself."""
    sides: dict[Names, list[Contact]] = {pair: [] for pair in part.view_pairs}
    for contact in part.contacts:
        pair = contact.source.name, contact.target.name
        sides[pair if pair in sides else pair[::-1]].append(contact)
    contact_ratios = {
        pair: max(side.contact_ratio for side in both) for pair, both in sides.items()
    }
    chosen = [pair for pair, ratio in contact_ratios.items() if ratio >= LEAST_CONTACT_RATIO]
    weighed = in_threads(pool_evidence, [[part.view_pairs[pair]] for pair in chosen])
    return [
        LinkAssessment(
            *pair, part.number, contact_ratios[pair], _rms(sides[pair]), evidence.probability
        )
        for pair, evidence in zip(chosen, weighed, strict=True)
    ]


def _scan(
    view: View, part: ComponentEvidence, tolerance: float, covariance: Array | None
) -> ScanAssessment:
    """A scan by its contacts with all others, and by what they show together."""
    pose, evidence, own = (
        part.poses[view.name], part.evidence[view.name], part.contacts_of(view.name),
    )  # fmt: skip
    uncertainty = None if covariance is None else Uncertainty.of(covariance, pose, view.points)
    if not own:
        alone = None if len(part.poses) == 1 else Grade.red
        return ScanAssessment(
            view.name, part.number, alone, None, "not in contact with any other scan", 0.0, None,
            None,
            (0.0, 0.0, 0.0), uncertainty,
        )  # fmt: skip
    in_contact = np.logical_or.reduce([contact.in_contact for contact in own])
    strength = axis_strength(view.normals[sampled(view)][in_contact])
    near = [contact.heights <= tolerance * surface_spacing(contact.target) for contact in own]
    coverage, inlier_ratio = float(in_contact.mean()), float(np.concatenate(near).mean())
    confidence = part.confidence(view.name)
    known = None if evidence.ambiguous else confidence
    colour = grade(known, coverage, inlier_ratio, min(strength))
    return ScanAssessment(
        view.name, part.number, colour, confidence, evidence.reason, coverage,
        inlier_ratio,
        _rms(own), strength, uncertainty,
    )  # fmt: skip


def _doubted(found: ScanAssessment) -> ScanAssessment:
    """The same for scans whose sensor stood still: not green."""
    if found.grade is not Grade.green:
        return found
    return replace(found, grade=Grade.amber, reason=STOOD_STILL)


def _rms(found: Sequence[Contact]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([contact.heights for contact in found]) ** 2)))
