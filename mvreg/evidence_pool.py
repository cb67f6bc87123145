"""Pool what several meetings of scans show: counts add up, and what holds holds together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mvreg import se3
from mvreg.evidence_measure import Flags, Side, look
from mvreg.types import Array, View

#: Of `best_step`, in units of the mean eigenvalue: `mvreg.stages.plane_icp` takes the same.
DAMPING = 1e-3


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

    @cached_property
    def sides(self) -> tuple[Side, Side]:
        """What the source's points show on the target, and the target's on the source.

        Looked at once, however often the meeting is weighed.
        """
        back = se3.invert(self.T_target_source)
        return (
            look(self.source, self.target, self.T_target_source),
            look(self.target, self.source, back),
        )


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


def firmness(
    meetings: Sequence[Meeting], sides: Sequence[tuple[Side, Side]]
) -> tuple[float, float]:
    """How firmly all that meets in one frame holds, and how far it asks to be moved.

    Returns
    -------
    stability : float
        See `smallest_eigenvalue`.
    pull : float
        See `best_step` (resolutions). Where there is no frame for all, both are those of the scan
        that is held most firmly.
    """
    groups: dict[int, list[tuple[Array, Array, Array, Array]]] = {}
    for (group, frame), meeting, (ahead, back) in zip(
        _frames(meetings), meetings, sides, strict=True
    ):
        home = frame @ se3.invert(meeting.T_target_source)  # `back` is in the target's frame
        for side, transform, sign in ((ahead, frame, 1.0), (back, home, -1.0)):
            turn, spots = transform[:3, :3].T, se3.apply(transform, side.spots)
            met = (spots, side.own @ turn, side.planes @ turn, sign * side.heights)
            groups.setdefault(group, []).append(met)
    found = [_firmness(*map(np.concatenate, zip(*g, strict=True))) for g in groups.values()]
    return max(found, default=(0.0, 0.0))


def _firmness(points: Array, first: Array, second: Array, heights: Array) -> tuple[float, float]:
    """Stability and pull, for points (N, 3), two estimates of the unit normals, and heights."""
    if not len(points):
        return 0.0, 0.0
    points = points - points.mean(axis=0)
    radius = np.sqrt((points**2).sum(axis=1).mean()) or 1.0
    one, two = (np.hstack([np.cross(points / radius, n), n]) for n in (first, second))
    return smallest_eigenvalue(one, two), best_step(two, heights)


def smallest_eigenvalue(first: Array, second: Array) -> float:
    """Of the mean of ``J^T J``, as `mvreg.stages.judge.stability`; 0 where something slides.

    But one J (N, 6) is from the normals of either scan: their noise, which is independent, then
    adds nothing. A sphere would look firm else, for its noisy normals.
    """
    product = first.T @ second / len(first)
    return max(float(np.linalg.eigvalsh((product + product.T) / 2)[0]), 0.0)


def best_step(jacobian: Array, heights: Array) -> float:
    """The length of the damped step (Gauss and Newton's) that closes the heights (N,) best."""
    normal = jacobian.T @ jacobian
    damping = DAMPING * np.trace(normal) / 6
    if not damping > 0:
        return 0.0
    step = np.linalg.solve(normal + damping * np.eye(6), jacobian.T @ heights)
    return float(np.linalg.norm(step))


def _frames(meetings: Sequence[Meeting]) -> list[tuple[int, Array]]:
    """A group and ``T_group_source`` of each meeting: what shares a group shares a frame."""
    if all(m.T_common_source is not None for m in meetings):
        return [(0, m.T_common_source) for m in meetings if m.T_common_source is not None]
    sources = [id(m.source) for m in meetings]
    if len(set(sources)) > 1 and len({id(m.target) for m in meetings}) == 1:
        return [(0, m.T_target_source) for m in meetings]
    return [(sources.index(source), np.eye(4)) for source in sources]
