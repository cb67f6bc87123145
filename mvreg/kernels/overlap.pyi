from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.tree import Tree

def contact_heights(
    tree: Tree,
    planes: Array,
    points: Array,
    normals: Array,
    transform: Array,
    reach: float,
    least_cosine: float,
) -> tuple[Indices, Array]: ...
def box(points: Array, transform: Array) -> tuple[Array, Array]: ...
