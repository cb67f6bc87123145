"""Scans as smooth surfaces: a patch of second order about every sample, fitted to the raw points.

A raw point is off the surface by the noise, and the nearest raw points of two scans are off each
other by the sampling, too. A patch averages the noise of all the raw points about it, and can be
asked anywhere between them: what is left is of third order. What lies on the patches of another
scan are cells: the means of the raw points about a sample, every one of which is in one cell, so
that all count, and all the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mvreg.evidence.view_pair import surface_samples
from mvreg.geometry.nearest import build_tree
from mvreg.kernels import fit
from mvreg.kernels.patches import Patches, gaps
from mvreg.kernels.results import Gaps
from mvreg.parallel import in_threads
from mvreg.stages.adjust.joint.noise import misfits, noise_variances
from mvreg.stages.adjust.joint.patches import along_rays, axes_about
from mvreg.types import Array, Indices, View
from mvreg.types.lazy import forget, lazy
from mvreg.types.scan import too_many_trees

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree
    from mvreg.surface.range_image import RangeImage

#: Patches per scan, at most: more of them share their raw points, and add nothing.
MOST_SAMPLES = 5000
#: Raw points per patch for each raw point per sample. With 3, patches are as wide as samples are
#: apart; with 4.5 the error on `figurine`'s gnome is a third smaller, for relief that a patch does
#: not follow shows better in it.
COVER = 4.5
#: Raw points per patch: its six numbers need some to spare. Of the 94 that Buddha's patches would
#: have 64 leave the surfaces as near each other, in two thirds of the time.
FEWEST, MOST = 20, 64
#: A patch whose points' mean is off its middle by more than this share of its radius is at a rim,
#: where surfaces bend and rays mix (Turk and Levoy 1994 drop matches there). Half a disc has 0.42.
LOPSIDED = 0.3
#: A cell does not depend on the patch about it. Where relief is no more than this share of the
#: noise it serves nearer to the rim, where rays graze, which hold best: errors are a tenth smaller
#: on `figurine`'s gnome and blobs. With cells on relief there as well, gnome's are a fifth larger
#: at a noise of a fifth of the spacing.
SMOOTH, OUTERMOST = 0.6, 0.5
#: Keeps a fit to points on a line or on one spot solvable (of a mean eigenvalue of one or so).
RIDGE = 1e-9
#: No scan is taken to be better than this (resolutions): exact data scatter by rounding only.
EXACT = 1e-6


@dataclass(frozen=True, eq=False)
class Surface:
    """Patches of one scan, in its frame, each with an origin and axes of its own.

    ``height(a, b) = slopes . (a, b) + bends . (a^2 / 2, a b, b^2 / 2)`` over the plane of the first
    two axes; the third is out of the surface, towards the sensor if that is known, see
    `mvreg.stages.adjust.joint.patches.along_rays`. What only kernels ask for is in `patches` alone:
    of a scan with 5,000 samples that is a megabyte.

    Parameters
    ----------
    patches : Patches
        Side by side, as the compiled kernels ask for them.
    points : (S, 3) array
        The origins, on the surface.
    normals : (S, 3) array
        Of the surface at the origins, unit.
    reach : (S,) array
        How far the raw points of the patch reach along it (length).
    density : (S,) array
        Raw points per area (1 / length^2); zero where all points are one.
    whole : (S,) array of bool
        Whether the raw points lie all around: on a patch that is not whole nothing lies.
    counts : (S,) array
        Raw points in the cell of each sample.
    noise : (S,) array
        Variance of raw points' heights about the surface (length^2).
    misfit : (S,) array
        Variance of what the patch does not follow (length^2).
    cosines : (S,) array
        Of the incidence of the sensor's rays; 1 where nothing is known of the sensor.
    fitted : int
        Raw points per patch.
    tree : Tree
        Of the origins.
    oriented : bool
        False where the signs of the normals mean nothing.
    """

    patches: Patches
    points: Array
    normals: Array
    reach: Array
    density: Array
    whole: NDArray[np.bool_]
    counts: Array
    noise: Array
    misfit: Array
    cosines: Array
    fitted: int
    tree: Tree
    oriented: bool

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


def surfaces(views: Sequence[View]) -> list[Surface]:
    """The surface of every view: of its scan's raw points, or of its own points where it has none.

    Samples are the view's own points, evenly thinned where there are more than 5000.
    """
    many = too_many_trees(view.scan for view in views if view.scan is not None)

    def surface(view: View) -> Surface:
        found = _surface(view)
        if many and view.scan is not None:
            forget(view.scan, "tree")
        return found

    return in_threads(surface, views)


def _surface(view: View) -> Surface:
    tree = view.tree if view.scan is None else view.scan.tree
    step = max(1, -(-len(view.points) // MOST_SAMPLES))
    samples, facing = view.points[::step], view.normals[::step]
    count = min(int(np.clip(COVER * tree.n / len(samples), FEWEST, MOST)), tree.n)
    least = (EXACT * view.scale.resolution) ** 2
    oriented = view.features.oriented
    return _fitted(tree, count, samples, facing, oriented, surface_samples(view).image, least)


def _fitted(
    tree: Tree, count: int, samples: Array, facing: Array, oriented: bool,
    image: RangeImage | None, least: float,
) -> Surface:  # fmt: skip
    """Patches fitted by least squares to the `count` raw points nearest to each sample."""
    axes = axes_about(facing)
    towards = None if image is None else image.towards(samples)
    if towards is not None:
        axes = along_rays(axes, towards)
    found = fit.fit(tree, samples, axes, count, RIDGE)
    normals = np.column_stack([-found.slopes, np.ones(len(samples))])[:, None] @ axes
    steep = np.linalg.norm(normals, axis=2)
    normals = normals[:, 0] / steep
    # Where the surface is along the line of points that differ in height only.
    points = samples + found.heights[:, None] * np.cross(axes[:, 0], axes[:, 1])
    area = np.pi * found.radius**2
    density = np.divide(count, area, out=np.zeros(len(samples)), where=area > 0)
    cosines = np.ones(len(samples))
    ranges = found.radius
    if image is not None and towards is not None:
        cosines = np.abs((normals * towards).sum(axis=1))
        ranges = np.zeros(len(samples))
        if image.origin is not None and image.direction is None:
            ranges = np.linalg.norm(samples - image.origin, axis=1)
    variances = found.variance / steep[:, 0] ** 2
    own = build_tree(points)
    noise = np.maximum(noise_variances(variances, count - 6, cosines, ranges), least)
    misfit = misfits(variances, noise, own)
    serves = (found.reach > 0) & (count >= FEWEST) & (found.counts > 0)
    outermost = np.where(misfit <= SMOOTH * noise, OUTERMOST, LOPSIDED)
    whole, usable = serves & (found.lopsided < LOPSIDED), serves & (found.lopsided < outermost)
    patches = Patches(
        own, points, axes, found.slopes, found.bends, normals, found.reach, whole, usable,
        found.means, found.seconds,
    )  # fmt: skip
    return Surface(
        patches=patches,
        points=points,
        normals=normals,
        reach=found.reach,
        density=density,
        whole=whole,
        counts=found.counts,
        noise=noise,
        misfit=misfit,
        cosines=cosines,
        fitted=count,
        tree=own,
        oriented=oriented,
    )  # fmt: skip
