import numpy as np
from numpy.typing import NDArray

from mvreg.geometry.arrays import Array, Indices

class Shape:
    def __init__(self, keypoints: Array, normals: Array, descriptors: Array) -> None: ...

class Rows:
    def __init__(self, rows: Array) -> None: ...
    def nearest(self, queries: Array) -> tuple[Array, Indices]: ...

def spread(
    source: Shape,
    target: Shape,
    seeds: Indices,
    oriented: bool,
    distance_tolerance: float,
    angle_tolerance: float,
    descriptor_tolerance: float,
    step: int,
) -> tuple[Indices, Indices]: ...
def consensus(
    source: Array, target: Array, matches: Indices, ends: Indices, draws: Indices, tolerance: float
) -> tuple[Array, NDArray[np.bool_]]: ...
