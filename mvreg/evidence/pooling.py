"""Pool the evidence of several view pairs: counts, information matrices and gradients add up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from threading import Lock

import numpy as np

from mvreg.evidence.view_pair import DirectedEvidence, directed_evidence
from mvreg.geometry import se3
from mvreg.geometry.arrays import Flags
from mvreg.types import Array, View
from mvreg.types.lazy import lazy

#: Of `gauss_newton_step`, in units of the mean eigenvalue: `mvreg.stages.refine.plane_base` takes
#: the same.
DAMPING = 1e-3
#: Below this share of the contact what is told by the points of few scans is not relied on.
LEAST_SEEN = 0.4
#: Subsampled evidence uses every n-th point.
SUBSAMPLING = 8


@dataclass(frozen=True, eq=False)
class ViewPair:
    """Two views and a relative pose: what evidence is measured of.

    Parameters
    ----------
    source, target : View
    T_target_source : (4, 4) array
    T_common_source : (4, 4) array, optional
        The source in a frame that all the view pairs weighed together share. Needed only where one
        partial model of several scans meets another: else the one scan that all view pairs have in
        common gives the frame.
    step : int
        Every n-th of the sampled points is used.
    """

    source: View
    target: View
    T_target_source: Array
    T_common_source: Array | None = None
    step: int = 1
    #: The `sides`, once they are known; who measures the same again may take them over.
    measured: list[tuple[DirectedEvidence, DirectedEvidence]] = field(
        default_factory=list, init=False, repr=False
    )
    _lock: Lock = field(default_factory=Lock, init=False, repr=False)

    @lazy
    def subsampled(self) -> ViewPair:
        """The same view pair, evaluated on every n-th point."""
        return replace(self, step=SUBSAMPLING)

    @property
    def sides(self) -> tuple[DirectedEvidence, DirectedEvidence]:
        """Evidence of the source's points on the target, and of the target's on the source.

        Evaluated once, however often the view pair is pooled, and by however many threads.
        """
        with self._lock:
            if not self.measured:
                back = se3.invert(self.T_target_source)
                self.measured.append(
                    (
                        directed_evidence(
                            self.source, self.target, self.T_target_source, self.step
                        ),
                        directed_evidence(self.target, self.source, back, self.step),
                    )
                )
        return self.measured[0]


def free_space_violation(sides: Sequence[DirectedEvidence]) -> tuple[float | None, str]:
    """The share of violations, and what it rests on: only scans that say it, if there are any.

    Sensors told from points count where they see `LEAST_SEEN` of the contact or more: of scans
    fused from several stations, a few look as if they were of one.
    """
    known = [side for side in sides if side.sensor_known]
    estimated = [side for side in sides if side.has_sensor]
    contact = sum(side.count for side in sides)
    if not known and sum(side.count for side in estimated) < LEAST_SEEN * contact:
        return None, "none"
    for sensor, chosen in (("known", known), ("estimated", estimated)):
        if chosen:
            front = sum(side.front for side in chosen)
            return front / max(front + sum(side.consistent for side in chosen), 1), sensor
    return None, "none"


def largest_surface_overlap(
    view_pairs: Sequence[ViewPair], sides: Sequence[tuple[DirectedEvidence, DirectedEvidence]]
) -> float:
    """The share of its points that the view best covered has on any of the others."""
    covered: dict[int, Flags] = {}
    for view_pair, pair in zip(view_pairs, sides, strict=True):
        for view, side in zip((view_pair.source, view_pair.target), pair, strict=True):
            covered[id(view)] = (
                covered.get(id(view), np.zeros_like(side.in_contact)) | side.in_contact
            )
    return max(
        (float(in_contact.mean()) for in_contact in covered.values() if len(in_contact)),
        default=0.0,
    )


def localizability_and_step(
    view_pairs: Sequence[ViewPair], sides: Sequence[tuple[DirectedEvidence, DirectedEvidence]]
) -> tuple[float, float]:
    """Localizability of all contacts in one frame, and the Gauss-Newton step that is left.

    Returns
    -------
    localizability : float
        See `smallest_eigenvalue`.
    residual_step : float
        See `gauss_newton_step` (resolutions). Where there is no frame for all, both are those of
        the scan with the larger localizability.
    """
    groups: dict[int, list[tuple[DirectedEvidence, Array, float]]] = {}
    for (group, frame), view_pair, (ahead, back) in zip(
        _frames(view_pairs), view_pairs, sides, strict=True
    ):
        T_common_target = frame @ se3.invert(
            view_pair.T_target_source
        )  # `back` is in the target's frame
        both = (ahead, frame, 1.0), (back, T_common_target, -1.0)
        groups.setdefault(group, []).extend(one for one in both if one[0].count)
    found = [_localizability_and_step(*zip(*one, strict=True)) for one in groups.values() if one]
    return max(found, default=(0.0, 0.0))


def _localizability_and_step(
    sides: Sequence[DirectedEvidence], frames: Sequence[Array], signs: Sequence[float]
) -> tuple[float, float]:
    """Localizability and residual step, given ``T_common_side`` and the signs of the heights.

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
    cross_information, information = (
        (about @ np.stack(each) @ back).sum(axis=0)
        for each in (
            [side.cross_information for side in sides],
            [side.information for side in sides],
        )
    )
    gradient = np.stack([sign * side.gradient for side, sign in zip(sides, signs, strict=True)])
    right = (about @ gradient[..., None])[..., 0].sum(axis=0)
    return smallest_eigenvalue(cross_information / counts.sum()), gauss_newton_step(
        information, right
    )


def smallest_eigenvalue(product: Array) -> float:
    """Of the mean of ``J^T J``, as `mvreg.stages.judge.localizability`; 0 where something slides.

    But the mean product (6, 6) is of two J from the normals of either scan: their noise, which is
    independent, then adds nothing. A sphere would look firm else, for its noisy normals.
    """
    return max(float(np.linalg.eigvalsh((product + product.T) / 2)[0]), 0.0)


def gauss_newton_step(normal: Array, right: Array) -> float:
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


def _frames(view_pairs: Sequence[ViewPair]) -> list[tuple[int, Array]]:
    """A group and ``T_group_source`` of each view pair: what shares a group shares a frame."""
    if all(m.T_common_source is not None for m in view_pairs):
        return [(0, m.T_common_source) for m in view_pairs if m.T_common_source is not None]
    sources = [id(m.source) for m in view_pairs]
    if len(set(sources)) > 1 and len({id(m.target) for m in view_pairs}) == 1:
        return [(0, m.T_target_source) for m in view_pairs]
    return [(sources.index(source), np.eye(4)) for source in sources]
