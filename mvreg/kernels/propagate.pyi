from mvreg.geometry.arrays import Array, Indices

class Shape:
    def __init__(self, keypoints: Array, normals: Array, descriptors: Array) -> None: ...

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
