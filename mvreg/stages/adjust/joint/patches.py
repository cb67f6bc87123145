"""Principal axes of the patches of a surface, and how many raw points each stands for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mvreg.kernels import fit
from mvreg.types import Array

if TYPE_CHECKING:
    from mvreg.kernels.tree import Tree

#: Nearest patches that tell how densely patches lie: a share of so many is known to a quarter.
AROUND = 12


def shares(tree: Tree, density: Array, total: int) -> Array:
    """How many of `total` raw points each patch stands for (S,).

    As densely as raw points lie there, over how densely patches do: patches that are spread evenly
    stand for few raw points where a surface was seen at a low angle.
    """
    count = min(AROUND, tree.n - 1)
    if count < 1:
        return np.full(tree.n, float(total))
    each: Array = density * fit.distances(tree, count) ** 2
    whole = float(each.sum())
    return each * (total / whole) if whole > 0 else np.full(tree.n, total / tree.n)


def axes_about(normals: Array) -> Array:
    """Right-handed axes (S, 3, 3), in rows, of which the third is the normal (S, 3)."""
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=1)
