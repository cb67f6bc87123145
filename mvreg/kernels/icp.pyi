from mvreg.geometry.arrays import Array
from mvreg.kernels.results import Registration
from mvreg.kernels.tree import Tree

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
) -> Registration: ...
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
) -> Registration: ...
