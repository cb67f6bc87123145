"""How strongly surfaces hold poses, from normals whose noise does not add to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mvreg.stages.adjust.joint.block_matrix import between_poses
from mvreg.stages.adjust.joint.normal_equations import System, weight
from mvreg.stages.adjust.joint.rows import Residuals, Rows
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.types import Array


def stiffness(
    found: Rows | Residuals, system: System, surfaces: Sequence[Surface], motions: Array,
    width: float,
) -> object:  # fmt: skip
    """The normal equations (6 F, 6 F) with the normals of both surfaces in each product.

    ``J^T W J`` has the noise of the normals squared in it. Along a direction that the shape hardly
    holds that is a share of what seems to hold it (errors in variables): poses then scatter more
    than it says. Two scans know the normal of one place with noise that is independent, so the
    product of the two has none in the mean (instrumental variables). Laid out as in
    `block_matrix`.
    """
    turned = [
        surface.normals @ motion[:3, :3].T
        for surface, motion in zip(surfaces, motions, strict=True)
    ]  # fmt: skip

    def blocks(tile: Rows) -> Array:
        some, weights = tile.contacts, tile.weights * weight(tile.residuals, width)
        made = np.empty((len(some.ways), 6, 6))
        for k, (source, _) in enumerate(some.ways):
            rows = slice(*some.ends[k : k + 2])
            theirs = tile.jacobian[rows]
            mine = turned[source][some.samples[rows]]
            along = (theirs[:, 3:] * mine).sum(axis=1)
            size = np.linalg.norm(theirs[:, 3:], axis=1)
            mine = mine * np.copysign(size, along)[:, None]
            mine = np.hstack([np.cross(tile.points[rows], mine), mine])
            one = theirs.T @ (weights[rows, None] * mine)
            made[k] = (one + one.T) / 2
        return made

    each = np.concatenate(found.in_tiles(blocks))
    source, target = system.place[found.contacts.ways].T
    return between_poses(each, source, target, len(system.gradient) // 6)
