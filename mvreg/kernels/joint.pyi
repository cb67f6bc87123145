from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.tree import Tree

class Patches:
    def __init__(
        self,
        tree: Tree,
        points: Array,
        axes: Array,
        slopes: Array,
        bends: Array,
        normals: Array,
        reach: Array,
        whole: NDArray[np.bool_],
    ) -> None: ...

def gaps(
    surface: Patches, points: Array, patches: Indices, flat: bool
) -> tuple[Array, Array, Array]: ...
def contacts(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    reach: float,
    stride: int,
    flat: bool,
    least_cosine: float,
    oriented: NDArray[np.bool_],
) -> tuple[Indices, Indices, Indices]: ...
def rows(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    ends: Indices,
    samples: Indices,
    patches: Indices,
    centre: Array,
    radius: float,
    flat: bool,
    residuals: Array,
    jacobian: Array,
    points: Array,
) -> None: ...
def normal_equations(
    jacobian: Array, residuals: Array, weights: Array, ends: Indices, width: float, cut: float
) -> tuple[Array, Array]: ...
def cell_sums(
    jacobian: Array,
    residuals: Array,
    weights: Array,
    points: Array,
    ends: Indices,
    width: float,
    cut: float,
    low: Array,
    edge: float,
    across: Indices,
) -> tuple[Indices, Indices, Array]: ...
def farthest(points: Array, before: Array, after: Array) -> float: ...
