"""How good a set of poses is: against the truth, and, without any truth, against the surfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.nearest import nearest
from mvreg.types import Array, View

#: Neighbours further apart than this are no overlap (resolutions).
REACH = 3.0
#: Normals that differ by more than about 45 degrees belong to different sheets of a surface.
LEAST_COSINE = 0.7
#: Points asked per ordered pair of views: the median of so many is stable to a per cent.
MOST_POINTS = 1000


@dataclass(frozen=True)
class ScanError:
    """How far one pose is from its truth.

    `rotation` is the Frobenius norm of the rotations' difference, `angle` the same in degrees,
    `translation` the 2-norm of the translations' difference (length).
    """

    rotation: float
    angle: float
    translation: float


@dataclass(frozen=True)
class PoseErrors:
    """The errors of the placed scans that have a truth, in the frame of the scan `frame`."""

    frame: str
    scans: Mapping[str, ScanError]

    @property
    def mean(self) -> ScanError:
        """Mean over the scans, the scan of the frame (error zero) included: e_R and e_t."""
        return ScanError(*(float(x) for x in self._table().mean(axis=0)))

    @property
    def max(self) -> ScanError:
        """The largest of each error."""
        return ScanError(*(float(x) for x in self._table().max(axis=0)))

    def _table(self) -> Array:
        return np.array([(e.rotation, e.angle, e.translation) for e in self.scans.values()])


def pose_errors(
    poses: Mapping[str, Array], truth: Mapping[str, Array] | None, reference: str
) -> PoseErrors | None:
    """Compare poses with the truth as the paper does, e_R and e_t.

    Both are re-based to the frame of one scan, ``M'_i = M_ref^-1 M_i``, because the truth's own
    frame is arbitrary. That scan is the reference; where the reference has no truth, it is the
    first placed scan that has (`PoseErrors.frame` names it), so that a partial truth still counts.
    The means include that scan, whose error is zero, as the paper's do.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan`` of the placed scans.
    truth : mapping of scan name to (4, 4) array, or None
        ``T_world_scan``; may miss scans.
    reference : str
        The scan whose frame is the model frame.

    Returns
    -------
    PoseErrors or None
        None where fewer than two placed scans have a truth: there is nothing to compare, and a
        mean of zero would look like a perfect answer.
    """
    known = [name for name in poses if truth is not None and name in truth]
    if truth is None or len(known) < 2:
        return None
    frame = reference if reference in known else known[0]
    found = se3.invert(poses[frame]) @ np.stack([poses[name] for name in known])
    right = se3.invert(truth[frame]) @ np.stack([truth[name] for name in known])
    rotations = np.linalg.norm((found - right)[:, :3, :3], axis=(1, 2))
    angles = np.degrees(se3.rotation_angle(found, right))
    translations = np.linalg.norm((found - right)[:, :3, 3], axis=1)
    rows = zip(rotations.tolist(), angles.tolist(), translations.tolist(), strict=True)
    return PoseErrors(frame, {name: ScanError(*row) for name, row in zip(known, rows, strict=True)})


@dataclass(frozen=True)
class Consistency:
    """Point-to-plane distances where placed views overlap: `median` and `rms` (length).

    `resolution` (length) is what the relative figures divide by; `points` distances were measured
    in `pairs` ordered pairs of views.
    """

    median: float
    rms: float
    resolution: float
    points: int
    pairs: int

    @property
    def relative_median(self) -> float:
        """The median in resolutions."""
        return self.median / self.resolution

    @property
    def relative_rms(self) -> float:
        """The RMS in resolutions."""
        return self.rms / self.resolution


def consistency(poses: Mapping[str, Array], views: Sequence[View]) -> Consistency | None:
    """How well the placed surfaces lie on each other; needs no ground truth.

    For every ordered pair of views whose bounding boxes overlap, points of one find their nearest
    neighbour in the other within 3 resolutions; where the normals agree, the distance along the
    other's normal counts. Points are taken evenly from each list, so the answer is deterministic.

    It measures how tightly overlaps close, not whether they are the right ones: a false placement
    that touches nothing leaves no trace here.

    Parameters
    ----------
    poses : mapping of scan name to (4, 4) array
        ``T_model_scan``; views without a pose are left out.
    views : sequence of View
        Registration points and normals, each in its scan's frame.

    Returns
    -------
    Consistency or None
        None where nothing overlaps.
    """
    placed = [view for view in views if view.name in poses and len(view.points)]
    resolution = placed[0].scale.resolution if placed else 0.0
    if len(placed) < 2 or not resolution > 0:
        return None
    reach = REACH * resolution
    found = []
    for i, j in neighbours(placed, poses, reach):
        source, target = placed[i], placed[j]
        transform = se3.invert(poses[target.name]) @ poses[source.name]
        found.append(_point_to_plane(source, target, transform, reach))
    found = [distances for distances in found if len(distances)]
    if not found:
        return None
    distances = np.concatenate(found)
    return Consistency(
        median=float(np.median(distances)),
        rms=float(np.sqrt(np.mean(distances**2))),
        resolution=resolution,
        points=len(distances),
        pairs=len(found),
    )


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
        Positions in `views`.
    """
    clouds = [se3.apply(poses[view.name], view.points) for view in views]
    low = np.stack([cloud.min(axis=0) for cloud in clouds]) - reach / 2
    high = np.stack([cloud.max(axis=0) for cloud in clouds]) + reach / 2
    near = (low[:, None] <= high[None]).all(axis=2) & (low[None] <= high[:, None]).all(axis=2)
    return [(int(i), int(j)) for i, j in np.argwhere(near) if i != j]


def _point_to_plane(source: View, target: View, T_target_source: Array, reach: float) -> Array:
    """Distances of source points to the target's tangent planes, where the surfaces meet."""
    step = -(-len(source.points) // MOST_POINTS)
    points = se3.apply(T_target_source, source.points[::step])
    normals = source.normals[::step] @ T_target_source[:3, :3].T
    # The box first: most points of a pair that hardly overlaps then cost no query.
    inside = ((points >= target.tree.mins - reach) & (points <= target.tree.maxes + reach)).all(1)
    points, normals = points[inside], normals[inside]
    distances, partners = nearest(target.tree, points, reach)
    met = np.isfinite(distances)
    points, normals, partners = points[met], normals[met], partners[met]
    planes = target.normals[partners]
    agree = np.abs(np.einsum("ij,ij->i", normals, planes)) > LEAST_COSINE
    offsets = points[agree] - target.points[partners[agree]]
    heights: Array = np.abs(np.einsum("ij,ij->i", offsets, planes[agree]))
    return heights
