from collections.abc import Sequence

from mvreg.geometry.arrays import Array, Flags
from mvreg.kernels.rays import Rays
from mvreg.kernels.results import Sight
from mvreg.kernels.tree import Tree

def directed_evidence(
    tree: Tree,
    planes: Array,
    points: Array,
    normals: Array,
    centre: Array,
    radius: float,
    transform: Array,
    reach: float,
    least_cosine: float,
    oriented: bool,
    rays: Rays | None,
    most_rays: int,
    tolerance: float,
    edge: float,
) -> Sight: ...
def which_may_overlap(
    centre: Array,
    radius: float,
    rays: Rays | None,
    reach: float,
    centres: Array,
    radii: Array,
    others: Sequence[Rays | None],
    reaches: Array,
    transforms: Array,
) -> Flags: ...
