"""What the verticals of two levelled views allow: matches of normals as steep, and level poses."""

from __future__ import annotations

import numpy as np

from mvreg.geometry.arrays import Flags
from mvreg.geometry.vertical import levelled, tilt
from mvreg.types import Array, Indices, View

#: Poses before refinement that tilt by more (degrees) are none. Of those within 12 degrees of the
#: truth a tenth tilts by 5 (street), 6 (yard) or 10 (office) and more. With 5 degrees 17 pairs of
#: an office and 46 of a street are refined to the right pose, with 15 they are 20 and 52;
#: without a vertical 20 and 51.
MOST_TILT = 15.0
#: Matched normals are as steep within this angle (degrees). In an office and a street that takes
#: half the time of the propagation and none of the right poses.
STEEP = 20.0


def as_steep(source: View, target: View, matches: Indices) -> Flags:
    """Which matches (M, 2) of keypoints have normals as steep, to `STEEP` degrees: (M,).

    The angle of a normal to the vertical stays what it is in all level poses. Signs count only
    where both views have them. All do where a vertical is not known.
    """
    if source.up is None or target.up is None:
        return np.ones(len(matches), dtype=bool)
    own = _steepness(source.features.normals[:, 0], source.up)[matches[:, 0]]
    other = _steepness(target.features.normals[:, 0], target.up)[matches[:, 1]]
    if not (source.features.oriented and target.features.oriented):
        own, other = np.minimum(own, 180 - own), np.minimum(other, 180 - other)
    found: Flags = np.abs(own - other) <= STEEP
    return found


def _steepness(normals: Array, up: Array) -> Array:
    """Angles (K,) of unit normals (K, 3) to the vertical (degrees)."""
    return np.degrees(np.arccos(np.clip(normals @ up, -1, 1)))


def levelled_poses(source: View, target: View, poses: Array) -> tuple[Array, Flags]:
    """The poses (C, 4, 4), levelled about the middle of the source's keypoints, and which (C,) may.

    Those may that tilted by `MOST_TILT` at most. Where a vertical is not known,
    all may, as they are.
    """
    if source.up is None or target.up is None:
        return poses, np.ones(len(poses), dtype=bool)
    near: Flags = tilt(poses, source.up, target.up) <= MOST_TILT
    middle = source.features.keypoints.mean(axis=0)
    return levelled(poses, source.up, target.up, middle), near
