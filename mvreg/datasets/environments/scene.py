"""A scene: solids, and what rays meet first."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mvreg.datasets.environments.solids import Solid
from mvreg.types import Array, Indices

#: Neighbouring rays are told by bundles of so many whether they may meet a solid.
BUNDLE = 24


@dataclass(frozen=True, eq=False)
class Scene:
    """Solids in the world frame, lengths in metres, z up; they may overlap."""

    solids: tuple[Solid, ...]

    def cast(self, start: Array, rays: Array, farthest: float = math.inf) -> tuple[Array, Array]:
        """What rays meet first.

        Parameters
        ----------
        start : (3,) array
            Outside all solids.
        rays : (N, 3) array
            Unit vectors; faster if neighbours follow each other.
        farthest : float
            What is farther away is not seen (length).

        Returns
        -------
        ranges, cosines : (N,) arrays
            From the start to the surface, infinite where there is none; the cosines of the angles
            of incidence.
        """
        ranges, cosines = np.full(len(rays), np.inf), np.zeros(len(rays))
        for index, nearest, towards in self._candidates(start, rays, farthest):
            towards = towards[ranges[towards] > nearest]
            if len(towards) == 0:
                continue
            found, slopes = self.solids[index].meet(start, rays[towards])
            closer = found < ranges[towards]
            chosen = towards[closer]
            ranges[chosen], cosines[chosen] = found[closer], slopes[closer]
        ranges[ranges > farthest] = np.inf
        return ranges, cosines

    def clearance(self, points: Array) -> Array:
        """How far from all solids points (N, 3) are at least (N,): 0 on one, negative inside."""
        gaps: Array = np.min([solid.clearance(points) for solid in self.solids], axis=0)
        return gaps

    def around(self, point: Array, distance: float) -> Scene:
        """The solids of which something may be within `distance` of a point (3,)."""
        centres, reaches = self._spheres
        near = np.linalg.norm(centres - point, axis=1) - reaches <= distance
        return Scene(tuple(self.solids[index] for index in np.flatnonzero(near)))

    @cached_property
    def _spheres(self) -> tuple[Array, Array]:
        """Centres (M, 3) and radii (M,) of spheres around the solids."""
        centres = np.array([solid.pose[:3, 3] for solid in self.solids])
        return centres, np.array([solid.reach for solid in self.solids])

    def _candidates(
        self, start: Array, rays: Array, farthest: float
    ) -> Iterator[tuple[int, float, Indices]]:
        """Solids from near to far: which, not nearer than what, and which rays may meet it."""
        centres, reaches = self._spheres
        offsets = centres - start
        distances = np.linalg.norm(offsets, axis=1)
        order = np.argsort(distances - reaches)
        order = order[distances[order] - reaches[order] <= farthest]
        axes, spreads = _bundles(rays)
        outside = np.maximum(distances, 1e-12)
        widths = np.arcsin(np.minimum(reaches / outside, 1.0)) + 1e-6
        widths[distances <= reaches] = np.pi
        towards = (offsets / outside[:, None])[order]
        angles = np.arccos(np.clip(towards @ axes.T, -1, 1))
        met = angles <= widths[order, None] + spreads
        members = np.arange(len(axes) * BUNDLE).reshape(-1, BUNDLE)
        for row, index in zip(met, order.tolist(), strict=True):
            chosen: Indices = members[row].ravel()
            if len(chosen) and chosen[-1] >= len(rays):
                chosen = chosen[chosen < len(rays)]
            yield index, float(distances[index] - reaches[index]), chosen


def _bundles(rays: Array) -> tuple[Array, Array]:
    """Axes (B, 3) of bundles of successive rays, and the widest angles from these (B,)."""
    missing = -len(rays) % BUNDLE
    bundles = np.concatenate([rays, np.repeat(rays[-1:], missing, axis=0)]).reshape(-1, BUNDLE, 3)
    axes = bundles.mean(axis=1)
    axes /= np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-12)
    cosines = np.einsum("bij,bj->bi", bundles, axes).min(axis=1)
    return axes, np.arccos(np.clip(cosines, -1, 1)) + 1e-6


def moved(solids: Iterable[Solid], transform: Array) -> list[Solid]:
    """The solids elsewhere, each moved by a rigid motion (4, 4)."""
    return [solid.moved(transform) for solid in solids]
