import numpy as np
from numpy.typing import NDArray

from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.results import Gaps
from mvreg.kernels.tree import Tree

class Patches:
    def __init__(
        self,
        tree: Tree,
        points: Array,
        axes: Array,
        slopes: Array,
        bends: Array,
        normals: Array,
        reach: Array,
        whole: NDArray[np.bool_],
        usable: NDArray[np.bool_],
        means: Array,
        seconds: Array,
    ) -> None: ...
    def arrays(
        self,
    ) -> tuple[
        Array,
        Array,
        Array,
        Array,
        Array,
        Array,
        NDArray[np.bool_],
        NDArray[np.bool_],
        Array,
        Array,
    ]: ...

def gaps(surface: Patches, points: Array, patches: Indices, flat: bool) -> Gaps: ...
