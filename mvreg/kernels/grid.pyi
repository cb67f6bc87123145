from mvreg.geometry.arrays import Array, Indices

class Cells:
    sizes: Indices
    means: Array
    cell: Indices
    def __init__(self, points: Array, step: float) -> None: ...
