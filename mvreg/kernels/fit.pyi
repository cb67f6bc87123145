from mvreg.geometry.arrays import Array
from mvreg.kernels.tree import Tree

def fit(
    tree: Tree, samples: Array, axes: Array, count: int, ridge: float
) -> tuple[Array, Array, Array, Array, Array]: ...
def distances(tree: Tree, rank: int) -> Array: ...
