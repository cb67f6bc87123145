"""What the scans of one partial model show of each other, and whose pose is to blame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mvreg.evaluation.grade import AMBER_CONFIDENCE
from mvreg.evidence.pooled import Evidence, Meeting, weigh
from mvreg.geometry import se3
from mvreg.parallel import in_threads
from mvreg.surface.contact import Contact, contacts
from mvreg.types import Array, View

#: Names of source and target.
Names = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Weighing:
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
    meetings : mapping of (source, target) to Meeting
        One per pair that has a contact.
    evidence : mapping of scan name to Evidence
        By all that a scan meets, but for what is to blame.
    blamed : set of str
        Scans in a wrong place, by all appearances.
    """

    number: int
    poses: Mapping[str, Array]
    views: Sequence[View]
    contacts: Sequence[Contact]
    meetings: Mapping[Names, Meeting]
    evidence: Mapping[str, Evidence]
    blamed: frozenset[str]

    @classmethod
    def of(cls, number: int, poses: Mapping[str, Array], views: Sequence[View]) -> Weighing:
        """Weigh the poses of one partial model."""
        placed = [view for view in views if view.name in poses]
        found = contacts(poses, placed)
        meetings = _meetings(found, poses)
        evidence, blamed = _weighed([view.name for view in placed], meetings)
        return cls(number, poses, placed, found, meetings, evidence, frozenset(blamed))

    def contacts_of(self, name: str) -> list[Contact]:
        """What lies on other scans of one scan; without those to blame, where there are others."""
        own = [contact for contact in self.contacts if contact.source.name == name]
        others = self.blamed - {name}
        return [contact for contact in own if contact.target.name not in others] or own


def _meetings(found: Sequence[Contact], poses: Mapping[str, Array]) -> dict[Names, Meeting]:
    """One meeting for the two contacts of a pair."""
    meetings: dict[Names, Meeting] = {}
    for contact in found:
        source, target = contact.source.name, contact.target.name
        if (target, source) not in meetings:
            transform = se3.invert(poses[target]) @ poses[source]
            both = contact.source, contact.target
            meetings[source, target] = Meeting(*both, transform, poses[source])
    return meetings


def _weighed(
    names: Sequence[str], meetings: Mapping[Names, Meeting]
) -> tuple[dict[str, Evidence], set[str]]:
    """The evidence for every scan, by all its neighbours, and the scans whose poses are to blame.

    A scan in a wrong place speaks against all that it meets. So the worst of them, if it is red, is
    left out of what the others are weighed with, and so on until none of the rest is red. That may
    be the reference, where all others agree among themselves.
    """

    def pool(name: str, without: set[str]) -> list[Meeting]:
        return [m for pair, m in meetings.items() if name in pair and not without & {*pair}]

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
