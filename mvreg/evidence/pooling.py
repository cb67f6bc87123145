"""Pool what several meetings of scans show: counts add up, and what holds holds together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from threading import Lock

import numpy as np

from mvreg.evidence.view_pair import Side, look
from mvreg.geometry import se3
from mvreg.geometry.arrays import Flags
from mvreg.types import Array, View
from mvreg.types.lazy import lazy

#: Of `best_step`, in units of the mean eigenvalue: `mvreg.stages.refine.plane_base` takes the same.
DAMPING = 1e-3
#: A rough look asks every so-manieth point.
ROUGH = 8


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
    step : int
        Every so-manieth of the points asked is asked, for a rough look.
    """

    source: View
    target: View
    T_target_source: Array
    T_common_source: Array | None = None
    step: int = 1
    _sides: list[tuple[Side, Side]] = field(default_factory=list, init=False, repr=False)
    _looking: Lock = field(default_factory=Lock, init=False, repr=False)

    @lazy
    def rough(self) -> Meeting:
        """The same, of every so-manieth point."""
        return replace(self, step=ROUGH)

    @property
    def sides(self) -> tuple[Side, Side]:
        """What the source's points show on the target, and the target's on the source.

        Looked at once, however often the meeting is weighed, and by however many threads.
        """
        with self._looking:
            if not self._sides:
                back = se3.invert(self.T_target_source)
                self._sides.append(
                    (
                        look(self.source, self.target, self.T_target_source, self.step),
                        look(self.target, self.source, back, self.step),
                    )
                )
        return self._sides[0]


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
    groups: dict[int, list[tuple[Side, Array, float]]] = {}
    for (group, frame), meeting, (ahead, back) in zip(
        _frames(meetings), meetings, sides, strict=True
    ):
        home = frame @ se3.invert(meeting.T_target_source)  # `back` is in the target's frame
        both = (ahead, frame, 1.0), (back, home, -1.0)
        groups.setdefault(group, []).extend(one for one in both if one[0].count)
    found = [_firmness(*zip(*one, strict=True)) for one in groups.values() if one]
    return max(found, default=(0.0, 0.0))


def _firmness(
    sides: Sequence[Side], frames: Sequence[Array], signs: Sequence[float]
) -> tuple[float, float]:
    """Stability and pull of what is met, given ``T_common_side`` and the signs of the heights.

    Their sums are about centres of their own. ``A = [[R, [e]x R], [0, R]]`` turns the coordinates
    ``[p x n, n]`` about such a centre into those about the middle of all, e away from it.
    """
    motions = np.stack(frames)
    turns = motions[:, :3, :3]
    counts = np.array([side.count for side in sides], dtype=float)
    first = np.stack([side.first for side in sides])
    centres = np.stack([side.centre for side in sides])
    centres = (turns @ centres[..., None])[..., 0] + motions[:, :3, 3]
    first = (turns @ first[..., None])[..., 0]
    middle = (first + counts[:, None] * (centres - centres[0])).sum(axis=0) / counts.sum()
    away = centres - centres[0] - middle
    second = np.array([side.second for side in sides]) + (
        away * (2 * first + counts[:, None] * away)
    ).sum(axis=1)
    radius = np.sqrt(max(second.sum(), 0.0) / counts.sum()) or 1.0
    about = np.zeros((len(sides), 6, 6))
    about[:, :3, :3] = turns / radius
    about[:, :3, 3:] = se3.skew(away / radius) @ turns
    about[:, 3:, 3:] = turns
    back = np.swapaxes(about, 1, 2)
    mixed, plain = (
        (about @ np.stack(each) @ back).sum(axis=0)
        for each in ([side.mixed for side in sides], [side.plain for side in sides])
    )
    pushed = np.stack([sign * side.pushed for side, sign in zip(sides, signs, strict=True)])
    right = (about @ pushed[..., None])[..., 0].sum(axis=0)
    return smallest_eigenvalue(mixed / counts.sum()), best_step(plain, right)


def smallest_eigenvalue(product: Array) -> float:
    """Of the mean of ``J^T J``, as `mvreg.stages.judge.stability`; 0 where something slides.

    But the mean product (6, 6) is of two J from the normals of either scan: their noise, which is
    independent, then adds nothing. A sphere would look firm else, for its noisy normals.
    """
    return max(float(np.linalg.eigvalsh((product + product.T) / 2)[0]), 0.0)


def best_step(normal: Array, right: Array) -> float:
    """The length of the damped step (Gauss and Newton's) that closes the heights h best.

    Parameters
    ----------
    normal, right : (6, 6) and (6,) arrays
        ``J^T J`` and ``J^T h``.
    """
    damping = DAMPING * np.trace(normal) / 6
    if not damping > 0:
        return 0.0
    step = np.linalg.solve(normal + damping * np.eye(6), right)
    return float(np.linalg.norm(step))


def _frames(meetings: Sequence[Meeting]) -> list[tuple[int, Array]]:
    """A group and ``T_group_source`` of each meeting: what shares a group shares a frame."""
    if all(m.T_common_source is not None for m in meetings):
        return [(0, m.T_common_source) for m in meetings if m.T_common_source is not None]
    sources = [id(m.source) for m in meetings]
    if len(set(sources)) > 1 and len({id(m.target) for m in meetings}) == 1:
        return [(0, m.T_target_source) for m in meetings]
    return [(sources.index(source), np.eye(4)) for source in sources]
