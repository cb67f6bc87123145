"""The evidence within one partial model, and which of its scans are misplaced."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from mvreg.evaluation.grade import AMBER_CONFIDENCE
from mvreg.evidence.calibration import LOOP, in_a_loop
from mvreg.evidence.pooled import Evidence, ViewPair, pool_evidence
from mvreg.geometry import se3
from mvreg.parallel import in_threads
from mvreg.surface.contact import Contact, contacts
from mvreg.types import Array, Pair, View

#: Names of source and target.
Names = tuple[str, str]


@dataclass(frozen=True, eq=False)
class ComponentEvidence:
    """One partial model, weighed.

    Parameters
    ----------
    number : int
        1 for the reference's.
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``.
    views : sequence of View
        Those that have a pose.
    contacts : sequence of Contact
        Of ordered pairs.
    view pairs : mapping of (source, target) to ViewPair
        One per pair that has a contact.
    evidence : mapping of scan name to Evidence
        By all view pairs of a scan, except those with misplaced scans.
    misplaced : set of str
        Scans whose poses the evidence contradicts.
    looped : set of str
        Scans that independent pairs hold which agree with each other.
    """

    number: int
    poses: Mapping[str, Array]
    views: Sequence[View]
    contacts: Sequence[Contact]
    view_pairs: Mapping[Names, ViewPair]
    evidence: Mapping[str, Evidence]
    misplaced: frozenset[str]
    looped: frozenset[str]

    @classmethod
    def of(
        cls,
        number: int,
        poses: Mapping[str, Array],
        views: Sequence[View],
        pairs: Sequence[Pair] = (),
    ) -> ComponentEvidence:
        """Weigh the poses of one partial model, given the pairs that were registered."""
        placed = [view for view in views if view.name in poses]
        found = contacts(poses, placed)
        view_pairs = _view_pairs(found, poses)
        names = [view.name for view in placed]
        looped = in_loops(pairs, names)
        evidence, misplaced = _evidence_by_scan(names, view_pairs, looped)
        return cls(number, poses, placed, found, view_pairs, evidence, frozenset(misplaced), looped)

    def confidence(self, name: str) -> float:
        """The probability that a scan is where it should be; loops that hold it count."""
        return confidence(self.evidence[name], name in self.looped)

    def contacts_of(self, name: str) -> list[Contact]:
        """Contacts of one scan; without misplaced neighbours, if there are others."""
        own = [contact for contact in self.contacts if contact.source.name == name]
        others = self.misplaced - {name}
        return [contact for contact in own if contact.target.name not in others] or own


def _view_pairs(found: Sequence[Contact], poses: Mapping[str, Array]) -> dict[Names, ViewPair]:
    """One view pair for the two contacts of a pair."""
    view_pairs: dict[Names, ViewPair] = {}
    for contact in found:
        source, target = contact.source.name, contact.target.name
        if (target, source) not in view_pairs:
            transform = se3.invert(poses[target]) @ poses[source]
            both = contact.source, contact.target
            view_pairs[source, target] = ViewPair(*both, transform, poses[source])
    return view_pairs


def _evidence_by_scan(
    names: Sequence[str], view_pairs: Mapping[Names, ViewPair], looped: frozenset[str]
) -> tuple[dict[str, Evidence], set[str]]:
    """The evidence for every scan by all its neighbours, and the misplaced scans.

    A misplaced scan contradicts all its neighbours. So the worst of them, if it is red, is
    left out of what the others are weighed with, and so on until none of the rest is red. That may
    be the reference, where all others agree among themselves.
    """

    def pool(name: str, without: set[str]) -> list[ViewPair]:
        return [m for pair, m in view_pairs.items() if name in pair and not without & {*pair}]

    answers = in_threads(pool_evidence, [pool(name, set()) for name in names])
    weighed = dict(zip(names, answers, strict=True))
    misplaced: set[str] = set()
    while red := [n for n in names if n not in misplaced and _is_red(weighed[n], n in looped)]:
        worst = min(red, key=lambda name: weighed[name].probability)
        misplaced.add(worst)
        met = {name for pair in view_pairs if worst in pair for name in pair} - misplaced
        pools = {name: pool(name, misplaced) for name in names if name in met}
        # A scan without other neighbours keeps the evidence of the misplaced one.
        pools = {name: meets for name, meets in pools.items() if meets}
        weighed.update(zip(pools, in_threads(pool_evidence, list(pools.values())), strict=True))
    return weighed, misplaced


def in_loops(pairs: Sequence[Pair], names: Collection[str]) -> frozenset[str]:
    """Scans of reliable pairs that others agree with, both of them among the `names`."""
    return frozenset(
        name
        for pair in pairs
        if pair.verdict.reliable and LOOP in pair.verdict.evidence
        if pair.source in names and pair.target in names
        for name in (pair.source, pair.target)
    )


def confidence(evidence: Evidence, looped: bool) -> float:
    """The probability of a pose by its evidence, and by the loop that holds it."""
    return in_a_loop(evidence.probability) if looped else evidence.probability


def _is_red(evidence: Evidence, looped: bool) -> bool:
    return evidence.ambiguous or confidence(evidence, looped) < AMBER_CONFIDENCE
