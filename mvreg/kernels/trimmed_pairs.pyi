from mvreg.geometry.arrays import Array
from mvreg.kernels.results import TrimmedPairs
from mvreg.kernels.tree import Tree

class Pairing:
    def __init__(
        self, tree: Tree, points: Array, bound: float, min_overlap: float, power: float
    ) -> None: ...

def trimmed(
    tree: Tree, points: Array, bound: float, min_overlap: float, power: float
) -> TrimmedPairs: ...
