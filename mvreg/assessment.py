"""How far the poses of a result are to be trusted, scan by scan; needs no ground truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from mvreg import se3
from mvreg.assessed import Assessment as Assessment
from mvreg.assessed import LinkAssessment as LinkAssessment
from mvreg.assessed import ScanAssessment as ScanAssessment
from mvreg.assessed import Uncertainty as Uncertainty
from mvreg.contact import Contact, asked, balance_of, coarse, contacts
from mvreg.errors import InputError
from mvreg.evidence import Evidence, Meeting, weigh
from mvreg.grade import AMBER_CONFIDENCE, Grade, grade
from mvreg.parallel import in_threads
from mvreg.types import Array, Result, Scan, ScanSet, View

#: Point-to-plane distances up to this are within tolerance (resolutions). Of the overlapping points
#: of the Bunny, Dragon and Buddha scans 82 to 92 per cent are, at their true poses; of a scan
#: that is turned by one degree 35 to 82 per cent, by two degrees at most 65.
TOLERANCE = 0.5
#: Pairs of which neither scan has so much of its points on the other tell too little to be listed.
LEAST_OVERLAP = 0.1


def assess(result: Result, views: Sequence[View] | Sequence[Scan | Array] | ScanSet) -> Assessment:
    """Say how far the poses of a result are to be trusted, by the scans alone.

    Every partial model is looked at by itself. Only scans whose bounding boxes overlap are
    compared, and at most a thousand points of each, evenly from its list.

    Parameters
    ----------
    result : Result
    views : sequence of View or of scans, or ScanSet
        What was registered. Scans are prepared as the default method would; views as they come
        from ``Pipeline.prepare`` spare that.

    Returns
    -------
    Assessment

    Raises
    ------
    InputError
        If a placed scan is not among the scans.
    """
    prepared = _prepared(result, views)
    scans: dict[str, ScanAssessment] = {}
    links: list[LinkAssessment] = []
    for number, poses in enumerate((result.poses, *result.components), start=1):
        placed = [view for view in prepared if view.name in poses]
        found = contacts(poses, placed)
        meetings = _meetings(found, poses)
        links += _links(number, found, meetings)
        weighed, blamed = _weighed(placed, meetings)
        for view in placed:
            others = blamed - {view.name}
            own = [contact for contact in found if contact.source is view]
            own = [contact for contact in own if contact.target.name not in others] or own
            covariance = result.covariances.get(view.name)
            scan = _scan(view, number, own, weighed[view.name], poses[view.name], covariance)
            scans[view.name] = scan if len(poses) > 1 else replace(scan, grade=None)
    resolution = prepared[0].scale.resolution if prepared else 0.0
    return Assessment(TOLERANCE * resolution, scans, tuple(links))


def _prepared(
    result: Result, views: Sequence[View] | Sequence[Scan | Array] | ScanSet
) -> Sequence[View]:
    if not isinstance(views, ScanSet) and all(isinstance(view, View) for view in views):
        return cast(Sequence[View], views)
    from mvreg.run import as_scans, load_method

    scans = as_scans(cast("Sequence[Scan | Array] | ScanSet", views))
    placed = [name for poses in (result.poses, *result.components) for name in poses]
    missing = sorted(set(placed) - {scan.name for scan in scans})
    if missing:
        raise InputError(
            f"the result places {', '.join(missing)}, which is not among the scans; expected the "
            "scans that were registered, under the same names"
        )
    return load_method().pipeline.prepare(scans, np.random.default_rng(0))


def _meetings(
    found: Sequence[Contact], poses: Mapping[str, Array]
) -> dict[tuple[str, str], Meeting]:
    """One meeting for the two contacts of a pair, by the names of source and target."""
    meetings: dict[tuple[str, str], Meeting] = {}
    for contact in found:
        source, target = contact.source.name, contact.target.name
        if (target, source) not in meetings:
            transform = se3.invert(poses[target]) @ poses[source]
            both = contact.source, contact.target
            meetings[source, target] = Meeting(*both, transform, poses[source])
    return meetings


def _links(
    number: int, found: Sequence[Contact], meetings: Mapping[tuple[str, str], Meeting]
) -> list[LinkAssessment]:
    """The pairs that overlap enough, each weighed by itself."""
    sides: dict[tuple[str, str], list[Contact]] = {pair: [] for pair in meetings}
    for contact in found:
        pair = contact.source.name, contact.target.name
        sides[pair if pair in sides else pair[::-1]].append(contact)
    overlaps = {pair: max(side.overlap for side in both) for pair, both in sides.items()}
    chosen = [pair for pair, overlap in overlaps.items() if overlap >= LEAST_OVERLAP]
    weighed = in_threads(weigh, [[meetings[pair]] for pair in chosen])
    return [
        LinkAssessment(*pair, number, overlaps[pair], _rms(sides[pair]), evidence.probability)
        for pair, evidence in zip(chosen, weighed, strict=True)
    ]


def _weighed(
    placed: Sequence[View], meetings: Mapping[tuple[str, str], Meeting]
) -> tuple[dict[str, Evidence], set[str]]:
    """The evidence for every scan, by all its neighbours, and the scans whose poses are to blame.

    A scan in a wrong place speaks against all that it meets. So the worst of them, if it is red, is
    left out of what the others are weighed with, and so on until none of the rest is red. That may
    be the reference, where all others agree among themselves.
    """

    def pool(name: str, without: set[str]) -> list[Meeting]:
        return [m for pair, m in meetings.items() if name in pair and not without & {*pair}]

    names = [view.name for view in placed]
    answers = in_threads(weigh, [pool(name, set()) for name in names])
    weighed = dict(zip(names, answers, strict=True))
    blamed: set[str] = set()
    while red := [n for n in names if n not in blamed and _is_red(weighed[n])]:
        worst = min(red, key=lambda name: weighed[name].probability)
        blamed.add(worst)
        met = {name for pair in meetings if worst in pair for name in pair} - blamed
        pools = {name: pool(name, blamed) for name in names if name in met}
        # A scan that nobody else meets is told what it met.
        pools = {name: meets for name, meets in pools.items() if meets}
        weighed.update(zip(pools, in_threads(weigh, list(pools.values())), strict=True))
    return weighed, blamed


def _is_red(evidence: Evidence) -> bool:
    return evidence.ambiguous or evidence.probability < AMBER_CONFIDENCE


def _scan(
    view: View,
    number: int,
    own: Sequence[Contact],
    evidence: Evidence,
    pose: Array,
    covariance: Array | None,
) -> ScanAssessment:
    """A scan by its contacts with all others, and by what they show together."""
    uncertainty = None if covariance is None else Uncertainty.of(covariance, pose, view.points)
    if not own:
        return ScanAssessment(
            view.name, number, Grade.red, None, "touches no other scan", 0.0, None, None,
            (0.0, 0.0, 0.0), uncertainty,
        )  # fmt: skip
    met = np.logical_or.reduce([contact.met for contact in own])
    balance = balance_of(view.normals[asked(view)][met])
    near = [contact.heights <= TOLERANCE * coarse(contact.target) for contact in own]
    overlap, within = float(met.mean()), float(np.concatenate(near).mean())
    probability = evidence.probability
    known = None if evidence.ambiguous else probability
    colour = grade(known, overlap, within, min(balance))
    return ScanAssessment(
        view.name, number, colour, probability, evidence.reason, overlap, within, _rms(own),
        balance, uncertainty,
    )  # fmt: skip


def _rms(found: Sequence[Contact]) -> float:
    return float(np.sqrt(np.mean(np.concatenate([contact.heights for contact in found]) ** 2)))
