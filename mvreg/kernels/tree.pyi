from collections.abc import Sequence

from mvreg.geometry.arrays import Array, Indices

class Tree:
    data: Array
    n: int
    mins: Array
    maxes: Array
    grain: float
    def __init__(self, points: Array) -> None: ...
    def nearest(self, x: Array, bound: float = ...) -> tuple[Array, Indices]: ...
    def query(
        self, x: Array, k: int | Sequence[int] = 1, distance_upper_bound: float = ...
    ) -> tuple[Array, Indices]: ...
