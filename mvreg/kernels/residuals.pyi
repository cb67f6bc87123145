from collections.abc import Sequence

from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.patches import Patches

def rows(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    ends: Indices,
    samples: Indices,
    patches: Indices,
    centre: Array,
    radius: float,
    flat: bool,
    residuals: Array,
    jacobian: Array,
    points: Array,
    aside: Array,
) -> None: ...
def farthest(points: Array, before: Array, after: Array) -> float: ...
