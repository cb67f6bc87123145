"""Scans as smooth surfaces: a patch of second order about every sample, fitted to the raw points.

A raw point is off the surface by the noise, and the nearest raw points of two scans are off each
other by the sampling, too. A patch averages the noise of all the raw points about it, and can be
asked anywhere between them: what is left is of third order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mvreg.evidence.view_pair import surface_samples
from mvreg.geometry.nearest import build_tree
from mvreg.kernels import fit
from mvreg.kernels.patches import Patches, gaps
from mvreg.kernels.results import Gaps
from mvreg.parallel import in_threads
from mvreg.stages.adjust.joint.patches import axes_about, shares
from mvreg.surface.normals import facing_normals
from mvreg.types import Array, Indices, View
from mvreg.types.lazy import lazy

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree

#: Patches per scan, at most: more of them share their raw points, and add nothing.
MOST_SAMPLES = 5000
#: Raw points per patch for each raw point per sample, so that patches reach over each other's rims:
#: with one point in ten sampled, a patch of 30 points is as wide as samples are apart.
COVER = 3
#: Raw points per patch: its six numbers need some to spare; more than so many take long.
FEWEST, MOST = 20, 100
#: A patch whose points' mean is off its middle by more than this share of its radius is at a rim,
#: where surfaces bend and rays mix (Turk and Levoy 1994 drop matches there). Half a disc has 0.42.
LOPSIDED = 0.3
#: Keeps a fit to points on a line or on one spot solvable (of a mean eigenvalue of one or so).
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class Surface:
    """Patches of one scan, in its frame, each with an origin and axes of its own.

    ``height(a, b) = slopes . (a, b) + bends . (a^2 / 2, a b, b^2 / 2)`` over the plane of the first
    two axes.

    Parameters
    ----------
    points : (S, 3) array
        The origins, on the surface.
    axes : (S, 3, 3) array
        Rows: two along the surface, and one out of it, towards the sensor if that is known.
    slopes : (S, 2) array
    bends : (S, 3) array
        1 / length.
    normals : (S, 3) array
        Of the surface at the origins, unit.
    reach : (S,) array
        How far the raw points of the patch reach along it (length).
    density : (S,) array
        Raw points per area (1 / length^2); zero where all points are one.
    whole : (S,) array of bool
        Whether the raw points lie all around; a patch that is not whole serves for nothing.
    incidence_weight : (S,) array
        In [0, 1]: the squared cosine of the incidence of the sensor's rays, 1 where nothing is
        known of the sensor. Ranges are the worse the more a ray grazes the surface; Turk and Levoy
        1994 weight points by this cosine. Its square takes what is left against the ``.conf`` poses
        of Bunny, Dragon and Buddha down by a fifth, a tenth and an eighth.
    share : (S,) array
        Raw points of the scan that each patch stands for.
    tree : Tree
        Of the origins.
    oriented : bool
        False where the signs of the normals mean nothing.
    """

    points: Array
    axes: Array
    slopes: Array
    bends: Array
    normals: Array
    reach: Array
    density: Array
    whole: NDArray[np.bool_]
    incidence_weight: Array
    share: Array
    tree: Tree
    oriented: bool

    @lazy
    def patches(self) -> Patches:
        """The patches as the compiled kernels ask for them."""
        return Patches(
            self.tree, self.points, self.axes, self.slopes, self.bends, self.normals, self.reach,
            self.whole,
        )  # fmt: skip

    @lazy
    def moments(self) -> tuple[Array, float]:
        """The mean of the origins (3,), and the sum of their squared distances from it."""
        middle = self.points.mean(axis=0)
        return middle, float(((self.points - middle) ** 2).sum())

    def gaps(self, points: Array, patches: Indices, flat: bool) -> Gaps:
        """How far points are from patches, across the surface and along it.

        Parameters
        ----------
        points : (M, 3) array
        patches : (M,) array
            One for each point.
        flat : bool
            Ask the tangent planes instead, for points that are far away.

        """
        return gaps(self.patches, points, patches, flat)


def surfaces(views: Sequence[View], dense: bool = False) -> list[Surface]:
    """The surface of every view: of its scan's raw points, or of its own points where it has none.

    Samples are the view's own points, evenly thinned where there are more than 5000; or every
    second raw point, if `dense`.
    """
    return in_threads(lambda view: _surface(view, dense), views)


def _surface(view: View, dense: bool) -> Surface:
    raw = view.points if view.scan is None else view.scan.points
    tree = view.tree if view.scan is None else view.scan.tree
    if dense and view.scan is not None:
        samples = raw[::2]
        facing = facing_normals(view.scan, samples, view.features)
    else:
        step = max(1, -(-len(view.points) // MOST_SAMPLES))
        samples, facing = view.points[::step], view.normals[::step]
    share = len(raw) / len(samples)
    count = min(int(np.clip(COVER * share, FEWEST, MOST)), len(raw))
    fitted = _fitted(tree, count, samples, facing, view.features.oriented)
    image = surface_samples(view).image
    if image is None:
        return fitted
    return replace(
        fitted, incidence_weight=(fitted.normals * image.towards(samples)).sum(axis=1) ** 2
    )


def _fitted(tree: Tree, count: int, samples: Array, facing: Array, oriented: bool) -> Surface:
    """Patches fitted by least squares to the `count` raw points nearest to each sample."""
    axes = axes_about(facing)
    found = fit.fit(tree, samples, axes, count, RIDGE)
    reach = found.reach
    unit = np.where(reach > 0, reach, 1.0)
    upright = np.column_stack([-found.slopes, np.ones(len(samples))])
    upright /= np.sqrt((upright**2).sum(axis=1, keepdims=True))
    points = samples + found.heights[:, None] * axes[:, 2]
    density = np.where(reach > 0, count / (np.pi * unit**2), 0.0)
    own = build_tree(points)
    return Surface(
        points=points,
        axes=axes,
        slopes=found.slopes,
        bends=found.bends,
        normals=(upright[:, None] @ axes)[:, 0],
        reach=reach,
        density=density,
        whole=(reach > 0) & (found.lopsided < LOPSIDED) & (count >= FEWEST),
        incidence_weight=np.ones(len(samples)),
        share=shares(own, density, tree.n),
        tree=own,
        oriented=oriented,
    )
