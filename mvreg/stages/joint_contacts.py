"""Where the surfaces of placed scans lie on each other: pairs of scans, and of their patches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.kernels import evidence, joint
from mvreg.parallel import in_parts
from mvreg.stages.joint_surface import Surface
from mvreg.surfaces import LEAST_COSINE, near_boxes
from mvreg.types import Array, Indices

#: Contacts of a pair of scans, at least: twice as many as a motion has degrees of freedom.
FEWEST = 12


@dataclass(frozen=True, eq=False)
class Contacts:
    """Samples of scan `i` (source) that lie on patches of scan `j` (target).

    `samples` and `patches` (M,) are positions in the two surfaces; `weights` (M,) say how much of
    what is known about the surface each one stands for.
    """

    i: int
    j: int
    samples: Indices
    patches: Indices
    weights: Array


@dataclass(frozen=True, eq=False)
class Gate:
    """Which contacts count: those closer than `reach` (length), of every `stride`-th sample.

    A `flat` gate asks the tangent planes of patches however far away from their middle, one that is
    not asks the curved patches, no farther along than their raw points reach.
    """

    reach: float
    stride: int = 1
    flat: bool = False


def touching(surfaces: Sequence[Surface], motions: Array, reach: float) -> list[tuple[int, int]]:
    """Pairs i < j of placed scans whose boxes in the model frame come within `reach` (length)."""
    placed = zip(surfaces, motions, strict=True)
    corners = [np.stack(evidence.box(s.points, motion)) for s, motion in placed]
    return near_boxes(corners, reach)


def contacts(
    surfaces: Sequence[Surface], motions: Array, pairs: Sequence[tuple[int, int]], gate: Gate
) -> list[Contacts]:
    """What lies on what, both ways, for every one of `pairs` that touches enough.

    Samples find the nearest patch; both must be whole, and the normals agree.

    Returns
    -------
    list of Contacts
        Of ordered pairs, in the order of `pairs`.
    """
    for k in {k for pair in pairs for k in pair}:
        _ = surfaces[k].patches  # built once, before the threads ask for it
    ways = [way for i, j in pairs for way in ((i, j), (j, i))]
    found = in_parts(lambda way: _contacts(surfaces, motions, *way, gate), ways)
    kept = [
        one
        for first, second in zip(found[::2], found[1::2], strict=True)
        if len(first.samples) + len(second.samples) >= FEWEST
        for one in (first, second)
        if len(one.samples)
    ]
    return _weighted(surfaces, kept, gate.stride)


def _contacts(surfaces: Sequence[Surface], motions: Array, i: int, j: int, gate: Gate) -> Contacts:
    """Contacts of scan i on scan j, without their weights."""
    source, target = surfaces[i], surfaces[j]
    samples, patches = joint.contacts(
        source.patches, target.patches, se3.invert(motions[j]) @ motions[i],
        gate.reach, gate.stride, gate.flat, LEAST_COSINE, source.oriented and target.oriented,
    )  # fmt: skip
    return Contacts(i, j, samples, patches, np.ones(len(samples)))


def _weighted(surfaces: Sequence[Surface], found: list[Contacts], stride: int) -> list[Contacts]:
    """The contacts with the weights that make the most of what all scans know of a surface.

    Where scans k of densities d_k lie on the same unknown surface, least squares over the poses and
    the surface leave, once the surface is eliminated, the weight ``d_i d_j / sum_k d_k`` per area
    to the gap between i and j. A sample of i stands for ``share_i / d_i`` of area; both ways count
    a half each. Thus nothing that three scans agree on is counted three times. What a sensor saw at
    a grazing angle counts less.
    """
    total = [surface.density.copy() for surface in surfaces]
    for one in found:
        total[one.i][one.samples] += surfaces[one.j].density[one.patches]
    weighted = []
    for one in found:
        theirs = surfaces[one.j].density[one.patches] / total[one.i][one.samples]
        trust = surfaces[one.i].trust[one.samples] * surfaces[one.j].trust[one.patches]
        weights = stride * surfaces[one.i].share[one.samples] * theirs * trust / 2
        weighted.append(Contacts(one.i, one.j, one.samples, one.patches, weights))
    return weighted
