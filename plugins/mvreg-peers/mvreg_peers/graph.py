"""The graph of pairs: its record of a pair, and its best spanning tree."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array, Verdict


@dataclass(frozen=True, eq=False)
class Edge:
    """What a peer made of the clouds number `source` and `target`.

    `coarse` and `pose` are ``T_target_source`` (4, 4) of the clouds, by features and refined; None
    where there is none. A higher `quality` is better. `information` (6, 6) is Open3D's.
    """

    source: int
    target: int
    verdict: Verdict
    coarse: Array | None = None
    pose: Array | None = None
    quality: float = 0.0
    information: Array | None = None
    iterations: int = 0
    converged: bool = True
    seconds: Mapping[str, float] = field(default_factory=dict)


def spanning_tree(edges: Iterable[Edge], root: int) -> dict[int, Array]:
    """Poses ``T_root_cloud`` (4, 4) along the maximum spanning tree of what is joined to `root`.

    Prim's algorithm: of the reliable edges that lead out of the tree, the best is added, and of
    equal ones the first.
    """
    left = sorted((e for e in edges if e.verdict.reliable), key=lambda edge: -edge.quality)
    poses = {root: np.eye(4)}
    while True:
        leading = (e for e in left if (e.source in poses) != (e.target in poses))
        edge = next(leading, None)
        if edge is None or edge.pose is None:
            return poses
        if edge.target in poses:
            poses[edge.source] = se3.project(poses[edge.target] @ edge.pose)
        else:
            inverse = se3.invert(se3.project(edge.pose))
            poses[edge.target] = se3.project(poses[edge.source] @ inverse)
