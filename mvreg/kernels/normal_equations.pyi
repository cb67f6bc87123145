from mvreg.geometry.arrays import Array, Indices
from mvreg.kernels.results import CellSums, NormalEquations

def normal_equations(
    jacobian: Array, residuals: Array, weights: Array, ends: Indices, width: float
) -> NormalEquations: ...
def cell_sums(
    jacobian: Array,
    residuals: Array,
    weights: Array,
    points: Array,
    ends: Indices,
    width: float,
    low: Array,
    edge: float,
    across: Indices,
) -> CellSums: ...
