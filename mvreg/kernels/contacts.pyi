from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.patches import Patches
from mvreg.kernels.results import PatchContacts

def contacts(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    reach: float,
    stride: int,
    flat: bool,
    least_cosine: float,
    oriented: NDArray[np.bool_],
) -> PatchContacts: ...
