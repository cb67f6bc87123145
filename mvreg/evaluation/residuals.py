"""How far each point lies from the surfaces of the other scans, under the poses of a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mvreg.geometry import se3
from mvreg.parallel import in_parts
from mvreg.surface.overlap import CONTACT_DISTANCE, build_trees, contact_heights, neighbours
from mvreg.types import Array, Indices, View

#: A raw point has the residual of the nearest registration point within so many resolutions.
NEAR = 2.0


def point_residuals(poses: Mapping[str, Array], views: Sequence[View]) -> dict[str, Array]:
    """Residuals of the registration points of every placed view.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan`` of one partial model.
    views : sequence of View
        Those without a pose are left out.

    Returns
    -------
    dict of scan name to (M,) array
        For each point the root mean square of its point-to-plane distances (length) from the
        surfaces of the other views that it is in contact with, as `mvreg.surface.consistency` has
        it; NaN where there is none.
    """
    placed = [view for view in views if view.name in poses and len(view.points)]
    squares = {view.name: np.zeros(len(view.points)) for view in placed}
    counts = {view.name: np.zeros(len(view.points)) for view in placed}
    resolution = placed[0].scale.resolution if placed else 0.0
    if len(placed) > 1 and resolution > 0:
        reach = CONTACT_DISTANCE * resolution
        pairs = neighbours(placed, poses, reach)
        inverse = [se3.invert(poses[view.name]) for view in placed]
        build_trees(placed)

        def heights(pair: tuple[int, int]) -> tuple[Indices, Array]:
            source, target = (placed[k] for k in pair)
            pose = inverse[pair[1]] @ poses[source.name]
            return contact_heights(source, target, pose, reach, most=len(source.points))

        for (k, _), (which, found) in zip(pairs, in_parts(heights, pairs), strict=True):
            squares[placed[k].name][which] += found**2
            counts[placed[k].name][which] += 1
    with np.errstate(invalid="ignore"):
        return {name: np.sqrt(squares[name] / counts[name]) for name in squares}


def of_raw_points(residuals: Array, indices: Indices, distances: Array, view: View) -> Array:
    """The residuals of the nearest registration points: (N,) for raw points of the scan.

    NaN where the nearest has none, or lies farther than `NEAR` resolutions.

    Parameters
    ----------
    residuals : (M,) array
        Of the registration points.
    indices, distances : (N,) arrays
        The nearest registration point of each raw point, as `mvreg.geometry.nearest` says it.
    view : View
    """
    return np.where(distances <= NEAR * view.scale.resolution, residuals[indices], np.nan)
