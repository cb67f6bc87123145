from mvreg.geometry.arrays import Array
from mvreg.kernels.results import FittedPatches
from mvreg.kernels.tree import Tree

def fit(tree: Tree, samples: Array, axes: Array, count: int, ridge: float) -> FittedPatches: ...
