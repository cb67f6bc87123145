from mvreg.geometry.arrays import Array

class Rays:
    def __init__(
        self, points: Array, direction: Array | None, origin: Array | None, reach: float
    ) -> None: ...
    def nearby(self, points: Array, most: int) -> tuple[Array, Array, Array]: ...
