from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.tree import Tree

Pairs = tuple[Indices, Indices, Array, float, float]

def trimmed(tree: Tree, points: Array, bound: float, min_overlap: float, power: float) -> Pairs: ...
def trimmed_icp(
    tree: Tree,
    points: Array,
    transform: Array,
    bound: float,
    least: float,
    min_overlap: float,
    power: float,
    max_iterations: int,
    tolerance: float,
    helped: bool = False,
) -> tuple[Array, Pairs, int, bool]: ...
def plane_icp(
    tree: Tree,
    normals: Array,
    points: Array,
    transform: Array,
    bound: float,
    least: float,
    min_overlap: float,
    exponent: float,
    max_iterations: int,
    tolerance: float,
    longest: float,
    helped: bool = False,
) -> tuple[Array, Pairs, int, bool]: ...
