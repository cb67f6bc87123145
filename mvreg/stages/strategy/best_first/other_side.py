"""The other side of something thin: a scan that fits may show the back of what the target shows.

Scissors or a spanner look from behind as they do turned over. A scan of the back, laid on one of
the front, meets it all over, the normals agree, and nothing floats: what relief there is lies
within the distances that these allow. The pose that is right, turned over and a thickness away, has
no surface in common, so that no search finds it and no contact speaks for it. What tells the sides
apart is how well they fit: two scans of one side differ by their noise, and by what their sensor
gets wrong, a small part of a resolution; front and back by their relief.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mvreg.evidence.pairing import view_pairs
from mvreg.evidence.pooled import Evidence, pool_evidence
from mvreg.evidence.view_pair import EVIDENCE_DISTANCE
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, nearest
from mvreg.types import Array, Registration, View
from mvreg.types.lazy import kept_on_argument

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree

#: A view is thin if its points are so near their plane (RMS, resolutions), about what evidence
#: takes for contact; and if it is so thin for its width. Scans of things have a quarter of their
#: width and more, but for sheets and tools; a campus is as flat, but 5 resolutions high.
THIN, FLAT = 2 * EVIDENCE_DISTANCE, 0.25
#: The extent of a view is that of its points but for this share at either end, which may be stray.
STRAY = 0.02
#: An outline fits turned over if so large a share of its points are so near another (resolutions).
FITS, ASIDE = 0.6, 2.0
#: Two sides differ beyond their noise by more than this (RMS, resolutions), as probably as not, and
#: how fast the odds change with it: ``experiments/accuracy/sides.py``. Where scissors share most of
#: their surface, right pairs have 0.11 at most, plausible wrong ones 0.2 and more.
EXCESS, STEEP = 0.18, 6.0
#: What turns an outline over, about one long axis or the other; how many of its points are asked,
#: and how often, until they fit.
MIRRORS, ASKED, STEPS = np.array([[0.0, 1.0, -1.0], [0.0, -1.0, 1.0]]), 400, 20


def other_side(registration: Registration, source: View, target: View) -> float:
    """The probability that the source shows the other side of what the target shows.

    0 for what is not thin, and for what does not fit its own outline turned over.

    Parameters
    ----------
    registration : Registration
        The pose in which it seems to show the same.
    source, target : View
    """
    if not fits_turned_over(source):
        return 0.0
    evidence = pool_evidence(view_pairs(source, target, registration.T_target_source))
    return float(1 / (1 + (EXCESS / max(beyond_noise(evidence), 1e-3)) ** STEEP))


def beyond_noise(evidence: Evidence) -> float:
    """By how much surfaces in contact differ beyond their noise (RMS, resolutions)."""
    return float(np.sqrt(max(evidence.residual**2 - 1, 0.0))) * evidence.noise


@kept_on_argument
def fits_turned_over(view: View) -> bool:
    """Whether a view is thin, and its outline fits itself turned over; kept on the view."""
    outline = _outline(view)
    if outline is None:
        return False
    few = outline[:: max(1, len(outline) // ASKED)]
    reach = ASIDE * max(view.scale.resolution, view.resolution)
    tree = build_tree(outline)
    return any(_fits(few * mirror, outline, tree, reach) for mirror in MIRRORS)


def _outline(view: View) -> Array | None:
    """The points (N, 3) of a thin view in its plane, the first coordinate 0; None if not thin."""
    if len(view.points) < 3:
        return None
    offsets = view.points - view.points.mean(axis=0)
    along = offsets @ np.linalg.eigh(offsets.T @ offsets)[1]
    low, high = np.quantile(along, [STRAY, 1 - STRAY], axis=0)
    height, width, _ = high - low
    unit = view.scale.resolution or 1.0
    if np.sqrt((along[:, 0] ** 2).mean()) > THIN * unit or height > FLAT * width:
        return None
    return np.asarray((along - (low + high) / 2) * [0.0, 1.0, 1.0])


def _fits(moving: Array, outline: Array, tree: Tree, reach: float) -> bool:
    """Whether points can be moved in the plane so that most have one of the outline near them."""
    for _ in range(STEPS):
        distances, indices = nearest(tree, moving)
        kept = distances <= np.quantile(distances, FITS)
        moving = se3.apply(_best_motion(moving[kept], outline[indices[kept]]), moving)
    return bool((nearest(tree, moving)[0] <= reach).mean() >= FITS)


def _best_motion(moving: Array, fixed: Array) -> Array:
    """The motion (4, 4) in the plane that brings points nearest to others (least squares)."""
    mean, goal = moving.mean(axis=0), fixed.mean(axis=0)
    (_, y, z), (_, v, w) = (moving - mean).T, (fixed - goal).T
    angle = np.arctan2(y @ w - z @ v, y @ v + z @ w)
    turn = se3.exp(np.array([angle, 0.0, 0.0, 0.0, 0.0, 0.0]))[:3, :3]
    return se3.from_parts(turn, goal - turn @ mean)
