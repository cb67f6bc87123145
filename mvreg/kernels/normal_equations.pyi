from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.results import GroupSums, NormalEquations

def normal_equations(
    jacobian: Array, residuals: Array, weights: Array, ends: Indices, width: float
) -> NormalEquations: ...
def group_sums(
    jacobian: Array, residuals: Array, weights: Array, groups: Indices, ends: Indices, width: float
) -> GroupSums: ...
