from collections.abc import Sequence

from mvreg.geometry.arrays import Array, Indices, Places
from mvreg.kernels.patches import Patches

def rows(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    ends: Indices,
    samples: Indices | Places,
    patches: Indices | Places,
    centre: Array,
    radius: float,
    flat: bool,
    residuals: Array,
    jacobian: Array,
    points: Array,
    aside: Array,
) -> None: ...
def farthest(points: Array, before: Array, after: Array) -> float: ...
