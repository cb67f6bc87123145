from collections.abc import Sequence

from mvreg.geometry.arrays import Array, Indices, Places
from mvreg.kernels.patches import Patches
from mvreg.kernels.results import NormalEquations

def normal_equations(
    surfaces: Sequence[Patches],
    motions: Array,
    ways: Indices,
    ends: Indices,
    samples: Places,
    patches: Places,
    begin: Indices,
    cells: Array,
    fits: Array,
    centre: Array,
    radius: float,
    flat: bool,
    width: float,
) -> NormalEquations: ...
def known_at(
    ways: Indices,
    ends: Indices,
    samples: Places,
    patches: Places,
    begin: Indices,
    precisions: Array,
) -> Array: ...
