from mvreg.kernels.results import TrimmedPairs
from mvreg.kernels.tree import Tree
from mvreg.types import Array

class Pairing:
    def __init__(
        self, tree: Tree, points: Array, bound: float, min_overlap: float, power: float
    ) -> None: ...

def trimmed(
    tree: Tree, points: Array, bound: float, min_overlap: float, power: float
) -> TrimmedPairs: ...
