from mvreg.kernels.tree import Tree
from mvreg.types import Array, Indices

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
