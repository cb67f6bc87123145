"""The Cramer-Rao bound on the poses of scans with known noise, and errors to compare with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mvreg.geometry import se3
from mvreg.kernels.patches import Patches
from mvreg.stages.adjust.joint.block_matrix import dense
from mvreg.stages.adjust.joint.correspondences import (
    FLAT_LEAST_COSINE,
    Contacts,
    Gate,
    contacts,
    touching,
)
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import System
from mvreg.stages.adjust.joint.rows import rows
from mvreg.stages.adjust.joint.surface import Surface, surfaces
from mvreg.stages.adjust.joint.weighting import Pooled
from mvreg.types import Array, Scan, View

#: Scans whose surfaces are nearer than this at the true poses show the same surface (resolutions).
NEAR = 2.0
#: Rays at a lower angle count as if they were at this one (cosine): the camera loses most of those.
GRAZING = 0.1
#: Points per scan of which displacements are averaged.
ASKED = 200


def bound(
    views: Sequence[View],
    truth: Mapping[str, Array],
    noise: float,
    growth: Callable[[Array], Array] = np.ones_like,
) -> dict[str, Array]:
    """Lower bound on the covariance (6, 6) of every unbiased estimate of each pose but the first.

    What is known: ranges with Gaussian noise, along known rays, of a smooth surface that is itself
    unknown. A surface element that scans k see with the precisions ``q_k = d_k / (noise cos)^2``
    per area (d points per area; noise along the ray, at an angle to the normal) says of the poses
    ``sum_k q_k J_k^T J_k`` less what goes into finding the surface, the Schur complement, which
    leaves ``q_i q_j / sum_k q_k`` for the gap between i and j. Summed over the samples of all
    scans, at the true poses, that is the information matrix of the joint refinement; the bound is
    its inverse, with the gauge fixed at the first pose.

    Parameters
    ----------
    views : sequence of View
        Their scans know the sensor's `view_point`.
    truth : mapping of scan name to (4, 4) array
        True poses in the frame of the first view.
    noise : float
        Standard deviation of the range (length).
    growth : callable
        How many times as large it is at ranges (S,).
    """
    shapes = [serving(surface) for surface in surfaces(views)]
    motions = np.stack([truth[view.name] for view in views])
    gate = Gate(NEAR * views[0].scale.resolution, least_cosine=FLAT_LEAST_COSINE)
    met = contacts(shapes, motions, touching(shapes, motions, gate.reach), gate)
    frame = Frame.of(shapes, motions)
    weighted = weigh(
        shapes, met, [precision(s, v.scan, growth) for s, v in zip(shapes, views, strict=True)]
    )
    residuals = rows(shapes, motions, weighted, frame, flat=False)
    free = list(range(1, len(views)))
    system = System.of(residuals, free, width=1e9)  # a kernel so wide is least squares
    inverse = np.linalg.inv(dense(system.normal)) * noise**2
    blocks = [inverse[k : k + 6, k : k + 6] for k in range(0, len(inverse), 6)]
    change = frame.twists
    return {views[k].name: change @ block @ change.T for k, block in zip(free, blocks, strict=True)}


def serving(surface: Surface) -> Surface:
    """The surface with all of its patches and cells in use, those at rims as well."""
    points, axes, slopes, bends, normals, reach, _, _, means, seconds = surface.patches.arrays()
    every = np.ones(len(surface.points), dtype=bool)
    patches = Patches(
        surface.tree, points, axes, slopes, bends, normals, reach, every, every, means, seconds
    )
    return replace(surface, whole=every, patches=patches)


def precision(
    surface: Surface, scan: Scan | None, growth: Callable[[Array], Array] = np.ones_like
) -> Array:
    """Precision (S,) of a surface's height per area, for noise of 1 along rays to the sensor.

    Or of `growth`, at their lengths (S,).
    """
    assert scan is not None and scan.view_point is not None
    towards = scan.view_point - surface.points
    ranges = np.linalg.norm(towards, axis=1)
    towards /= ranges[:, None]
    cosines = np.maximum(np.abs((towards * surface.normals).sum(axis=1)), GRAZING)
    found: Array = surface.density / (cosines * growth(ranges)) ** 2
    return found


def weigh(shapes: Sequence[Surface], found: Contacts, precisions: Sequence[Array]) -> Contacts:
    """Contacts with the information that each stands for; both ways count a half each."""
    known, precise = Pooled.of(shapes), np.concatenate(precisions)
    samples, patches = known.places(found)
    mine, theirs = precise[samples], precise[patches]
    total = precise + np.bincount(samples, theirs, len(precise))
    return replace(found, weights=known.area[samples] * mine * theirs / total[samples] / 2)


def scatter(
    views: Sequence[View], truth: Mapping[str, Array], covariances: Mapping[str, Array]
) -> float:
    """RMS displacement of the scans' points that covariances (6, 6) of their poses imply (length).

    Of all scans but the first, each as much as another.
    """
    squares = []
    for view in views[1:]:
        points = se3.apply(truth[view.name], asked(view))
        eye = np.broadcast_to(np.eye(3), (len(points), 3, 3))
        change = np.concatenate([-se3.skew(points), eye], axis=2)
        each = np.einsum("mij,jk,mik->m", change, covariances[view.name], change)
        squares.append(each.mean())
    return float(np.sqrt(np.mean(squares)))


def displacement(
    views: Sequence[View], truth: Mapping[str, Array], poses: Mapping[str, Array]
) -> float:
    """RMS displacement of the scans' points under poses, against the truth (length).

    Of all scans but the first, each as much as another; both in the first one's frame.
    """
    squares = []
    for view in views[1:]:
        points = asked(view)
        gaps = se3.apply(poses[view.name], points) - se3.apply(truth[view.name], points)
        squares.append((gaps**2).sum(axis=1).mean())
    return float(np.sqrt(np.mean(squares)))


def asked(view: View) -> Array:
    """Some of a view's points (M, 3), evenly from its list."""
    return view.points[:: max(1, len(view.points) // ASKED)]
