"""The model graph: views as nodes, registrations as edges, and trees within it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Array


@dataclass(frozen=True, eq=False)
class Edge:
    """A registration between the views number `source` and `target`; lower `cost` is better."""

    source: int
    target: int
    T_target_source: Array
    cost: float


def poses_from(root: int, edges: Iterable[Edge]) -> dict[int, Array]:
    """Poses ``T_root_view`` (4, 4) of what the edges connect to `root`, breadth first.

    The root comes first, then what is one edge away, and so on. Where the edges have loops the
    first of the shortest ways counts.
    """
    ways: dict[int, list[tuple[int, Array]]] = {}
    for edge in edges:
        ways.setdefault(edge.target, []).append((edge.source, edge.T_target_source))
        ways.setdefault(edge.source, []).append((edge.target, se3.invert(edge.T_target_source)))
    poses = {root: np.eye(4)}
    waiting = deque([root])
    while waiting:
        here = waiting.popleft()
        for there, T_here_there in ways.get(here, ()):
            if there not in poses:
                poses[there] = se3.project(poses[here] @ T_here_there)
                waiting.append(there)
    return poses


def crossing(
    first: Mapping[int, Array], second: Mapping[int, Array], edge: Edge
) -> dict[tuple[int, int], Array]:
    """The pairs that an edge implies between two trees that it joins, itself left out.

    Parameters
    ----------
    first, second : mappings of int to (4, 4) array
        ``T_target_view`` of the tree with the edge's target, ``T_source_view`` of that with its
        source, as `poses_from` gives them.
    edge : Edge

    Returns
    -------
    dict
        ``T_a_b`` (4, 4) by (a, b), a in `first` and b in `second`.
    """
    return {
        (a, b): se3.invert(T_target_a) @ edge.T_target_source @ T_source_b
        for a, T_target_a in first.items()
        for b, T_source_b in second.items()
        if (a, b) != (edge.target, edge.source)
    }
