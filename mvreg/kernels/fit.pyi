from mvreg.kernels.tree import Tree
from mvreg.types import Array

def fit(
    tree: Tree, samples: Array, axes: Array, count: int, ridge: float
) -> tuple[Array, Array, Array, Array, Array]: ...
def distances(tree: Tree, rank: int) -> Array: ...
