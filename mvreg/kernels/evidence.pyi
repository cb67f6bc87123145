from mvreg.geometry.arrays import Array
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
) -> Sight: ...
def may_overlap(
    centre: Array,
    radius: float,
    rays: Rays | None,
    other_centre: Array,
    other_radius: float,
    other_rays: Rays | None,
    transform: Array,
    reach: float,
) -> bool: ...
