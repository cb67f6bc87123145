"""Cross-sections through the model, and enlarged where its surfaces are furthest apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, neighbours_of
from mvreg.report.page.shown import Shown
from mvreg.types import Array, View

#: Sections, and how far their places lie apart at least (sizes of the model).
SECTIONS, APART = 3, 0.2
#: Half of the width of an enlarged section, half of the thickness of its slab (resolutions), and
#: that of the slab of the whole section (sizes of the model).
WINDOW, SLAB, WHOLE_SLAB = 12.0, 1.5, 0.004
#: Points near a place that its residual is the median of: within so many resolutions, so many at
#: most and at least, so that the border of a scan or the other side of a thin part does not count;
#: and how many places are asked.
AROUND, NEIGHBOURS, ENOUGH, ASKED = 8.0, 120, 20, 1000
#: Points drawn of one scan in one section.
MOST = 600


@dataclass(frozen=True, eq=False)
class Section:
    """One section: the place (3,), and for each scan what is drawn, by name.

    `whole` and `enlarged` map names to coordinates (M, 2) about the place: along the surface and
    along its normal, lengths. `apart` is the residual there, `half` half of the width enlarged.
    """

    place: Array
    apart: float
    half: float
    whole: Mapping[str, Array]
    enlarged: Mapping[str, Array]


def sections(
    poses: Mapping[str, Array],
    views: Sequence[View],
    residuals: Mapping[str, Array],
    shown: Sequence[Shown],
) -> list[Section]:
    """Sections of one partial model, where residuals are largest.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
    views : sequence of View
    residuals : mapping of scan name to (M,) array
        See `mvreg.evaluation.residuals.point_residuals`.
    shown : sequence of Shown
        The points that are drawn.
    """
    placed = [view for view in views if view.name in residuals and view.name in poses]
    resolution = placed[0].scale.resolution if placed else 0.0
    if not resolution > 0:
        return []
    points = np.concatenate([se3.apply(poses[v.name], v.points) for v in placed])
    normals = np.concatenate([v.normals @ poses[v.name][:3, :3].T for v in placed])
    apart = np.concatenate([residuals[v.name] for v in placed])
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    moved = {one.name: se3.apply(poses[one.name], one.points) for one in shown if one.name in poses}
    return [
        _section(points[k], normals[k], value, resolution, size, moved)
        for k, value in _places(points, apart, resolution, size)
    ]


def _places(points: Array, apart: Array, resolution: float, size: float) -> list[tuple[int, float]]:
    """Positions among the points, and the residuals about them: the largest, far from each other.

    The median of the points around counts.
    """
    known = np.flatnonzero(np.isfinite(apart))
    if not len(known):
        return []
    order = known[:: -(-len(known) // ASKED)]
    count = min(NEIGHBOURS, len(known))
    distances, indices = neighbours_of(build_tree(points[known]), points[order], count)
    near = distances <= AROUND * resolution
    values = np.where(near, apart[known][np.minimum(indices, len(known) - 1)], np.nan)
    enough = near.sum(axis=1) >= ENOUGH
    local = np.zeros(len(order))
    local[enough] = np.nanmedian(values[enough], axis=1)
    found: list[tuple[int, float]] = []
    for rank in np.argsort(-local, kind="stable"):
        k = int(order[rank])
        if all(np.linalg.norm(points[k] - points[other]) > APART * size for other, _ in found):
            found.append((k, float(local[rank])))
        if len(found) == SECTIONS:
            break
    return found


def _section(
    place: Array,
    normal: Array,
    apart: float,
    resolution: float,
    size: float,
    moved: Mapping[str, Array],
) -> Section:
    """The section by the plane of the normal and the steepest direction across the longest one."""
    upwards = np.eye(3)[int(np.argmin(np.abs(normal)))]
    along = np.cross(normal, np.cross(upwards, normal))
    along /= np.linalg.norm(along) or 1.0
    axes = np.stack([along, normal])
    across = np.cross(along, normal)
    half = WINDOW * resolution
    whole: dict[str, Array] = {}
    enlarged: dict[str, Array] = {}
    for name, points in moved.items():
        offsets = points - place
        depth = np.abs(offsets @ across)
        flat = offsets @ axes.T
        thin = flat[depth <= WHOLE_SLAB * size]
        near = flat[(depth <= SLAB * resolution) & (np.abs(flat).max(axis=1) <= half)]
        for kept, chosen in ((whole, thin), (enlarged, near)):
            if len(chosen):
                kept[name] = chosen[:: -(-len(chosen) // MOST)]
    return Section(place, apart, half, whole, enlarged)
