"""Pool what several meetings of scans show: counts add up, and what holds holds together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.evidence_measure import Flags, Side
from mvreg.types import Array, View


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


def free_space(sides: Sequence[Side]) -> tuple[float | None, str]:
    """The share of violations, and what it rests on: only scans that say it, if there are any."""
    for sensor, chosen in (
        ("known", [side for side in sides if side.known]),
        ("estimated", [side for side in sides if side.told]),
    ):
        if chosen:
            front = sum(side.front for side in chosen)
            return front / max(front + sum(side.consistent for side in chosen), 1), sensor
    return None, "none"


def most_covered(meetings: Sequence[Meeting], sides: Sequence[tuple[Side, Side]]) -> float:
    """The share of its points that the view best covered has on any of the others."""
    covered: dict[int, Flags] = {}
    for meeting, pair in zip(meetings, sides, strict=True):
        for view, side in zip((meeting.source, meeting.target), pair, strict=True):
            covered[id(view)] = covered.get(id(view), np.zeros_like(side.met)) | side.met
    return max((float(met.mean()) for met in covered.values() if len(met)), default=0.0)


def firmness(meetings: Sequence[Meeting], sides: Sequence[tuple[Side, Side]]) -> float:
    """How firmly all that meets in one frame holds, whatever way it is pushed.

    As `mvreg.stages.judge.stability`, the smallest eigenvalue of the mean of ``J^T J``, but with
    one J from the normals of either scan: their noise, which is independent, then adds nothing. A
    sphere would look firm else, for its noisy normals.
    """
    groups: dict[int, list[tuple[Array, Array, Array]]] = {}
    for (group, frame), meeting, (ahead, back) in zip(
        _frames(meetings), meetings, sides, strict=True
    ):
        home = frame @ se3.invert(meeting.T_target_source)  # `back` is in the target's frame
        for side, transform in ((ahead, frame), (back, home)):
            turn = transform[:3, :3].T
            spots = se3.apply(transform, side.spots)
            groups.setdefault(group, []).append((spots, side.own @ turn, side.planes @ turn))
    return max(
        (_smallest(*map(np.concatenate, zip(*group, strict=True))) for group in groups.values()),
        default=0.0,
    )


def _frames(meetings: Sequence[Meeting]) -> list[tuple[int, Array]]:
    """A group and ``T_group_source`` of each meeting: what shares a group shares a frame."""
    if all(m.T_common_source is not None for m in meetings):
        return [(0, m.T_common_source) for m in meetings if m.T_common_source is not None]
    sources = [id(m.source) for m in meetings]
    if len(set(sources)) > 1 and len({id(m.target) for m in meetings}) == 1:
        return [(0, m.T_target_source) for m in meetings]
    return [(sources.index(source), np.eye(4)) for source in sources]


def _smallest(points: Array, first: Array, second: Array) -> float:
    """The smallest eigenvalue for points (N, 3) and two estimates of the unit normals there."""
    if not len(points):
        return 0.0
    points = points - points.mean(axis=0)
    radius = np.sqrt((points**2).sum(axis=1).mean()) or 1.0
    one, two = (np.hstack([np.cross(points / radius, n), n]) for n in (first, second))
    product = one.T @ two / len(points)
    return max(float(np.linalg.eigvalsh((product + product.T) / 2)[0]), 0.0)
