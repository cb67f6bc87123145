from mvreg.geometry.arrays import Array

def hidden(
    points: Array, directions: Array, landmark: Array, cell: float, depth: float
) -> Array: ...
