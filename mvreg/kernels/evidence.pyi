import numpy as np
from numpy.typing import NDArray

from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.tree import Tree

class Rays:
    def __init__(
        self, points: Array, direction: Array | None, origin: Array | None, reach: float
    ) -> None: ...
    def nearby(self, points: Array, most: int) -> tuple[Array, Array, Array]: ...

def look(
    tree: Tree,
    planes: Array,
    points: Array,
    normals: Array,
    centre: Array,
    radius: float,
    transform: Array,
    reach: float,
    least_cosine: float,
    oriented: bool,
    rays: Rays | None,
    most_rays: int,
    tolerance: float,
) -> tuple[NDArray[np.bool_], int, int, int, Array]: ...
def may_meet(
    centre: Array,
    radius: float,
    rays: Rays | None,
    other_centre: Array,
    other_radius: float,
    other_rays: Rays | None,
    transform: Array,
    reach: float,
) -> bool: ...
def touch(
    tree: Tree,
    planes: Array,
    points: Array,
    normals: Array,
    transform: Array,
    reach: float,
    least_cosine: float,
) -> tuple[Indices, Array]: ...
def box(points: Array, transform: Array) -> tuple[Array, Array]: ...
def hidden(
    points: Array, directions: Array, landmark: Array, cell: float, depth: float
) -> Array: ...
