"""Where partial models are shown: side by side, as how they lie to each other is not known."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array, View

#: Gap between two partial models, in widths of the first.
GAP = 0.3


def side_by_side(
    poses: Mapping[str, Array],
    components: Sequence[Mapping[str, Array]],
    views: Mapping[str, View],
) -> dict[str, Array]:
    """A pose to be shown for every placed scan.

    The reference's partial model keeps its frame; each of the others is shifted, without a turn, to
    stand beside the one before along the x axis, its middle level with the first's.

    Parameters
    ----------
    poses, components
        As in `Result`.
    views : mapping of name to View

    Returns
    -------
    dict of scan name to (4, 4) array
    """
    shown = dict(poses)
    low, high = _box(poses, views)
    edge, gap, level = high[0], GAP * (high[0] - low[0]), (low + high) / 2
    for part in components:
        low, high = _box(part, views)
        shift = level - (low + high) / 2
        shift[0] = edge + gap - low[0]
        edge = high[0] + shift[0]
        beside = se3.from_parts(np.eye(3), shift)
        shown |= {name: beside @ pose for name, pose in part.items()}
    return shown


def _box(poses: Mapping[str, Array], views: Mapping[str, View]) -> tuple[Array, Array]:
    """The box about scans in their model's frame; a point where there are none."""
    spots = [
        se3.apply(pose, corners(views[name].points))
        for name, pose in poses.items()
        if name in views and len(views[name].points)
    ]
    if not spots:
        return np.zeros(3), np.zeros(3)
    together = np.concatenate(spots)
    return together.min(axis=0), together.max(axis=0)


def corners(points: Array) -> Array:
    """The corners (8, 3) of the box about points (N, 3)."""
    ends: Iterable[Array] = np.stack([points.min(axis=0), points.max(axis=0)], axis=1)
    return np.stack(np.meshgrid(*ends), axis=-1).reshape(8, 3)
