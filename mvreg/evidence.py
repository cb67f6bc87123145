"""How probable it is that scans are where a pose puts them: all that range scans can tell of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from mvreg import se3
from mvreg.evidence_measure import Flags, Side, look
from mvreg.types import Array, View

#: Less is held too loosely: caps of a sphere have 0.0003, pairs of the Bunny 0.02 and more.
LEAST_STABILITY = 0.003


@dataclass(frozen=True, eq=False)
class Meeting:
    """Two views, and where one is said to be in the frame of the other.

    Parameters
    ----------
    source, target : View
    T_target_source : (4, 4) array
    T_common_source : (4, 4) array, optional
        The source in a frame that all the meetings weighed together share. Needed only where one
        partial model of several scans meets another: else the one scan that all meetings have in
        common gives the frame.
    """

    source: View
    target: View
    T_target_source: Array
    T_common_source: Array | None = None


@dataclass(frozen=True)
class Evidence:
    """What meetings show, pooled. Everything is free of units.

    Parameters
    ----------
    overlap : float
        Share of the points of a view that lie on the others' surface; of the view best covered.
    residual : float
        Root mean square point-to-plane distance there, in units of the scans' own noise floor.
    agreement : float
        Share of those near the surface whose normals agree with it.
    violation : float or None
        Share of the points that a sensor can tell about which float in what it saw to be free; None
        where no sensor is known.
    stability : float
        How firmly the overlap holds, whatever way it is pushed; see `mvreg.stages.judge.stability`.
    points : int
        How many points meet.
    """

    overlap: float
    residual: float
    agreement: float
    violation: float | None
    stability: float
    points: int

    @property
    def probability(self) -> float:
        """The probability that the pose is right, between 0 and 1."""
        if self.points < 50:
            return 0.0
        share = min(max(self.overlap, 1e-3), 1 - 1e-3)
        score = 2.0 * np.log(share / (1 - share)) + 2.0
        score += 12.0 * (self.agreement - 0.8) - 4.0 * np.log(max(self.residual, 1.0) / 3.0)
        score += 0.0 if self.violation is None else 40.0 * (0.1 - self.violation)
        return float(1 / (1 + np.exp(-np.clip(score, -30.0, 30.0))))

    @property
    def ambiguous(self) -> bool:
        """Whether the overlap can slide along itself, as on a sphere, a plane or a cylinder."""
        return self.points >= 50 and self.stability < LEAST_STABILITY

    @property
    def reason(self) -> str:
        """What speaks against the pose most, or that nothing does."""
        if self.points < 50:
            return "the scans hardly meet"
        if self.ambiguous:
            return "ambiguous: the overlap can slide along itself"
        if self.violation is not None and self.violation > 0.1:
            return "a surface stands in what the other sensor saw to be free"
        if self.residual > 6:
            return "the surfaces do not lie on each other"
        if self.agreement < 0.8:
            return "normals disagree"
        if self.overlap < 0.2:
            return "too little overlap"
        return "surfaces, normals and free space agree"

    def as_dict(self) -> dict[str, float]:
        """What was measured, by name; what is not known is left out."""
        return {name: float(value) for name, value in asdict(self).items() if value is not None}


def weigh(meetings: Sequence[Meeting]) -> Evidence:
    """Pool what all meetings show: evidence for or against all of them being right together.

    Parameters
    ----------
    meetings : sequence of Meeting
        One for a pair of scans; one scan against every part of a model; every scan of a partial
        model against every scan of another.

    Returns
    -------
    Evidence
        Of no points and an overlap of zero where nothing meets.
    """
    sides = [
        (look(m.source, m.target, m.T_target_source),
         look(m.target, m.source, se3.invert(m.T_target_source)))
        for m in meetings
    ]  # fmt: skip
    both = [side for pair in sides for side in pair]
    points = sum(int(side.met.sum()) for side in both)
    near = sum(side.near for side in both)
    consistent, front = sum(s.consistent for s in both), sum(s.front for s in both)
    known = any(side.told for side in both)
    return Evidence(
        overlap=_overlap(meetings, sides),
        residual=float(np.sqrt(sum(side.squared for side in both) / points)) if points else 0.0,
        agreement=points / near if near else 0.0,
        violation=front / max(front + consistent, 1) if known else None,
        stability=_stability(meetings, sides),
        points=points,
    )


def _overlap(meetings: Sequence[Meeting], sides: Sequence[tuple[Side, Side]]) -> float:
    """The share of its points that the view best covered has on any of the others."""
    covered: dict[int, Flags] = {}
    for meeting, pair in zip(meetings, sides, strict=True):
        for view, side in zip((meeting.source, meeting.target), pair, strict=True):
            covered[id(view)] = covered.get(id(view), np.zeros_like(side.met)) | side.met
    return max((float(met.mean()) for met in covered.values() if len(met)), default=0.0)


def _frames(meetings: Sequence[Meeting]) -> list[tuple[int, Array]]:
    """A group and ``T_group_source`` of each meeting: what shares a group shares a frame."""
    if all(m.T_common_source is not None for m in meetings):
        return [(0, m.T_common_source) for m in meetings if m.T_common_source is not None]
    sources = [id(m.source) for m in meetings]
    if len(set(sources)) > 1 and len({id(m.target) for m in meetings}) == 1:
        return [(0, m.T_target_source) for m in meetings]
    return [(sources.index(source), np.eye(4)) for source in sources]


def _stability(meetings: Sequence[Meeting], sides: Sequence[tuple[Side, Side]]) -> float:
    """Smallest eigenvalue of the mean of ``J^T J`` over all that meets in one frame."""
    groups: dict[int, list[tuple[Array, Array]]] = {}
    for (group, frame), meeting, (ahead, back) in zip(
        _frames(meetings), meetings, sides, strict=True
    ):
        home = frame @ se3.invert(meeting.T_target_source)  # `back` is in the target's frame
        for side, transform in ((ahead, frame), (back, home)):
            spots = se3.apply(transform, side.spots)
            groups.setdefault(group, []).append((spots, side.planes @ transform[:3, :3].T))
    return max((_firmness(*map(np.concatenate, zip(*g, strict=True))) for g in groups.values()),
               default=0.0)  # fmt: skip


def _firmness(points: Array, normals: Array) -> float:
    """As `mvreg.stages.judge.stability`, of points (N, 3) and the unit normals there."""
    if not len(points):
        return 0.0
    points = points - points.mean(axis=0)
    radius = np.sqrt((points**2).sum(axis=1).mean())
    jacobian = np.hstack([np.cross(points / (radius or 1.0), normals), normals])
    return max(float(np.linalg.eigvalsh(jacobian.T @ jacobian / len(jacobian))[0]), 0.0)
