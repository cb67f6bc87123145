"""The graph of pairs: its record of a pair, and its best spanning tree."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from mvreg.geometry import se3
from mvreg.types import Array, Edge, Verdict, ViewGraph


@dataclass(frozen=True, eq=False)
class Attempt:
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


def spanning_tree(attempts: Iterable[Attempt], root: int) -> dict[int, Array]:
    """Poses ``T_root_cloud`` (4, 4) along the maximum spanning tree of what is joined to `root`.

    By `quality`, of the reliable attempts, see `mvreg.types.ViewGraph.spanning_tree`.
    """
    edges = tuple(
        Edge(each.source, each.target, se3.project(each.pose), cost=-each.quality)
        for each in attempts
        if each.verdict.reliable and each.pose is not None
    )
    return ViewGraph(edges).spanning_tree(root).poses(root)
