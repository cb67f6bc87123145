"""Contact between placed scans, point by point; needs no ground truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mvreg.geometry import se3
from mvreg.parallel import in_threads
from mvreg.surface.overlap import (
    CONTACT_DISTANCE,
    build_trees,
    contact_heights,
    neighbours,
    sampled,
)
from mvreg.types import Array, View


@dataclass(frozen=True, eq=False)
class Contact:
    """Which of the sampled points of one view are in contact with another.

    `in_contact` (S,) tells which of the sampled points of the source have the target's surface
    beside them, with a normal that agrees; `heights` (M,) are the point-to-plane distances of
    those, in order.
    """

    source: View
    target: View
    in_contact: NDArray[np.bool_]
    heights: Array

    @property
    def contact_ratio(self) -> float:
        """Share of the source's points that met."""
        return float(self.in_contact.mean())


def contacts(poses: Mapping[str, Array], views: Sequence[View]) -> list[Contact]:
    """The contacts of every ordered pair of placed views whose bounding boxes overlap.

    As in `mvreg.surface.consistency`: the nearest neighbour within 3 resolutions counts, if the
    normals agree; of a view that is sparser than the others, within 3 of its own resolutions. One
    query per such pair, none for pairs that are apart.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``, all in one frame; views without a pose are left out.
    views : sequence of View

    Returns
    -------
    list of Contact
        Those without a single point that met are left out.
    """
    placed = [view for view in views if view.name in poses and len(view.points)]
    reach = CONTACT_DISTANCE * max((surface_spacing(view) for view in placed), default=0.0)
    if len(placed) < 2 or not reach > 0:
        return []
    pairs = neighbours(placed, poses, reach)
    inverse = [se3.invert(poses[view.name]) for view in placed]
    build_trees(placed)

    def contact(pair: tuple[int, int]) -> Contact:
        source, target = (placed[k] for k in pair)
        return _contact(source, target, inverse[pair[1]] @ poses[source.name])

    return [found for found in in_threads(contact, pairs) if found.in_contact.any()]


def surface_spacing(view: View) -> float:
    """The spacing (length) at which a view's surface is known: its own, if it is a sparse one."""
    return max(view.scale.resolution, view.resolution)


def _contact(source: View, target: View, T_target_source: Array) -> Contact:
    which, heights = contact_heights(
        source, target, T_target_source, CONTACT_DISTANCE * surface_spacing(target)
    )
    in_contact = np.zeros(len(source.points[sampled(source)]), dtype=bool)
    in_contact[which] = True
    return Contact(source, target, in_contact, heights)


def axis_strength(normals: Array) -> tuple[float, float, float]:
    """Translational strength of a surface along each axis, the other two being free.

    With the mean M of ``n n^T`` over the unit normals, what a shift along an axis costs once the
    shifts along the others have given way is ``1 / (M^-1)_aa``, the Schur complement of the others
    in M. Three times that is 1 where the normals are spread evenly, as on a sphere, and 0 where the
    scan can slide along the axis. Without the others' giving way it would be ``3 M_aa``, which is
    1 for a slanted plane that holds hardly anything. It is about shifts alone: a sphere, which can
    turn, has strength 1.

    Parameters
    ----------
    normals : (N, 3) array
        Unit normals where a scan lies on others, in its own frame; their signs do not matter.

    Returns
    -------
    tuple of 3 floats
        In [0, 1]; zeros for no normals.
    """
    if not len(normals):
        return 0.0, 0.0, 0.0
    mean = normals.T @ normals / len(normals)
    # A trace of one: 1e-9 is nothing beside it, and keeps what a plane leaves free at zero.
    held = 3 / np.diagonal(np.linalg.inv(mean + 1e-9 * np.eye(3)))
    x, y, z = np.clip(held, 0.0, 1.0).tolist()
    return x, y, z
