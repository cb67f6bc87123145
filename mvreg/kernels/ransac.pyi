import numpy as np
from numpy.typing import NDArray

from mvreg.geometry.arrays import Array, Indices

def consensus(
    source: Array, target: Array, matches: Indices, ends: Indices, draws: Indices, tolerance: float
) -> tuple[Array, NDArray[np.bool_]]: ...
