"""Types of the arrays that are passed around."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Coordinates, transforms and the like: float64.
Array = NDArray[np.float64]
#: Positions in another array.
Indices = NDArray[np.intp]
#: The same in half the memory, in arrays that are many and none of them long: C's int.
Places = NDArray[np.intc]
#: One truth value per row of another array.
Flags = NDArray[np.bool_]
