import numpy as np
from numpy.typing import NDArray

from mvreg.kernels.tree import Tree
from mvreg.types import Array, Indices

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
    source: Patches,
    target: Patches,
    transform: Array,
    reach: float,
    stride: int,
    flat: bool,
    least_cosine: float,
    oriented: bool,
) -> tuple[Indices, Indices]: ...
def rows(
    source: Patches,
    target: Patches,
    source_motion: Array,
    target_motion: Array,
    samples: Indices,
    patches: Indices,
    centre: Array,
    radius: float,
    flat: bool,
) -> tuple[Array, Array, Array]: ...
def normal_equations(
    jacobian: Array, residuals: Array, weights: Array, width: float, cut: float
) -> tuple[Array, Array]: ...
def cell_sums(
    jacobian: Array,
    residuals: Array,
    weights: Array,
    points: Array,
    width: float,
    cut: float,
    low: Array,
    edge: float,
    across: Indices,
) -> tuple[Indices, Array]: ...
def farthest(points: Array, before: Array, after: Array) -> float: ...
def fit(
    tree: Tree, samples: Array, axes: Array, count: int, ridge: float
) -> tuple[Array, Array, Array, Array, Array]: ...
def distances(tree: Tree, rank: int) -> Array: ...
