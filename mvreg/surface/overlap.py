"""Which points of one view lie on the surface of another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mvreg.geometry.boxes import boxes_within
from mvreg.kernels import overlap
from mvreg.surface.partners import well_spread
from mvreg.types import Array, Indices, View

#: Largest distance of a point from a surface that it is in contact with (resolutions).
CONTACT_DISTANCE = 3.0
#: Normals that differ by more than about 45 degrees belong to different sheets of a surface.
LEAST_COSINE = 0.7
#: Points sampled per ordered pair of views: the median of so many is stable to a per cent.
MOST_POINTS = 1000


def build_trees(views: Sequence[View]) -> None:
    """Build the trees of all views, before threads ask for them one by one."""
    for view in views:
        _ = view.tree


def neighbours(
    views: Sequence[View], poses: Mapping[str, Array], reach: float
) -> list[tuple[int, int]]:
    """Ordered pairs of views whose boxes in the model frame come within `reach` of each other.

    Parameters
    ----------
    views : sequence of View
        All with points, all with a pose.
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``.
    reach : float
        Length.

    Returns
    -------
    list of (int, int)
        Positions in `views`; of many that meet each other those that
        `mvreg.surface.partners.well_spread` chooses.
    """
    boxes = [overlap.box(view.points, poses[view.name]) for view in views]
    pairs = boxes_within([low for low, _ in boxes], [high for _, high in boxes], reach)
    pairs = well_spread(
        pairs, [view.points for view in views], [poses[view.name] for view in views],
        views[0].scale.resolution if views else 0.0,
    )  # fmt: skip
    return sorted([*pairs, *((j, i) for i, j in pairs)])


def sampled(view: View, most: int = MOST_POINTS) -> slice:
    """The points of a view that are sampled: at most `most`, evenly spread over the list."""
    return slice(None, None, max(1, -(-len(view.points) // most)))


def contact_heights(
    source: View, target: View, T_target_source: Array, reach: float, most: int = MOST_POINTS
) -> tuple[Indices, Array]:
    """Where the sampled points of a view, at most `most`, lie on the surface of another.

    Returns
    -------
    which : (M,) array
        Positions among the points `sampled`: those with a neighbour within `reach` (length), and a
        normal that agrees with its own.
    heights : (M,) array
        Their distances from the tangent planes there (length).
    """
    chosen = sampled(source, most)
    return overlap.contact_heights(
        target.tree, target.normals, source.points[chosen], source.normals[chosen],
        T_target_source, reach, LEAST_COSINE,
    )  # fmt: skip
