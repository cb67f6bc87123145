"""The view graph: scans as nodes, judged pairs as edges. Public as part of `mvreg.types`."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.geometry.arrays import Array
from mvreg.types import checks
from mvreg.types.lazy import lazy
from mvreg.types.records import Registration
from mvreg.types.view import Model, View

Key = TypeVar("Key", bound=Hashable)
#: A node: the name of a scan, or its position in a sequence.
Node: TypeAlias = Any


@dataclass(frozen=True, eq=False)
class Edge:
    """One relative motion between two nodes: ``x_target = T_target_source @ x_source``.

    Parameters
    ----------
    source, target : hashable
        Names of scans, or their positions in a sequence.
    T_target_source : (4, 4) array
    overlap : float
        Share of the source's points that lie on the target, in [0, 1].
    trimmed_mse : float
        What the refinement left (length^2).
    cost : float
        Lower is better; what spanning trees are chosen by.
    """

    source: Node
    target: Node
    T_target_source: Array
    overlap: float = 0.0
    trimmed_mse: float = 0.0
    cost: float = 0.0

    def __post_init__(self) -> None:
        checks.number("Edge.overlap", self.overlap, 0.0, 1.0)
        checks.length("Edge.trimmed_mse", self.trimmed_mse)
        checks.keep(self, T_target_source=checks.pose("Edge.T_target_source", self.T_target_source))

    @classmethod
    def of(cls, registration: Registration, source: View, target: View) -> Edge:
        """The edge that a registration amounts to.

        A merged model is no node: its frame is that of its first view, which stands for it.
        """
        pose = registration.T_target_source
        ends = source.name, target.name
        if isinstance(target, Model):
            first = target.parts[0]
            ends, pose = (source.name, first.view.name), se3.invert(first.T_model_scan) @ pose
        return cls(*ends, pose, registration.overlap, registration.trimmed_mse)


@dataclass(frozen=True, eq=False)
class Loop:
    """A way between two nodes: `motion` (4, 4) is ``T_end_start``, along `steps` edges."""

    motion: Array
    steps: int


def breadth_first(start: Key, ways: Mapping[Key, Iterable[Key]]) -> dict[Key, Key | None]:
    """What can be reached from `start`, nearest first, each with the node that it is reached from.

    Parameters
    ----------
    start : hashable
        Comes first; reached from None.
    ways : mapping
        The neighbours of each node; a node without any may be missing.
    """
    found: dict[Key, Key | None] = {start: None}
    waiting = deque([start])
    while waiting:
        here = waiting.popleft()
        for there in ways.get(here, ()):
            if there not in found:
                found[there] = here
                waiting.append(there)
    return found


def reachable(pairs: Iterable[tuple[Key, Key]], start: Key) -> set[Key]:
    """What is joined to `start` by a chain of pairs, itself included."""
    ways: dict[Key, list[Key]] = {}
    for first, second in pairs:
        ways.setdefault(first, []).append(second)
        ways.setdefault(second, []).append(first)
    return set(breadth_first(start, ways))


@dataclass(frozen=True, eq=False)
class ViewGraph:
    """Accepted pairs, in the order in which they were accepted; changed by making another.

    Parameters
    ----------
    edges : tuple of Edge
        Any number between the same two nodes; nodes without an edge are not in the graph.
    """

    edges: tuple[Edge, ...] = ()

    def __len__(self) -> int:
        return len(self.edges)

    def __iter__(self) -> Iterator[Edge]:
        return iter(self.edges)

    def with_edge(self, edge: Edge) -> ViewGraph:
        """The graph with one more edge, the last."""
        return ViewGraph((*self.edges, edge))

    def without(self, nodes: Collection[Node]) -> ViewGraph:
        """The graph without some nodes, and without their edges."""
        return ViewGraph(
            tuple(e for e in self.edges if e.source not in nodes and e.target not in nodes)
        )

    def among(self, nodes: Collection[Node]) -> ViewGraph:
        """The graph of some nodes, with the edges between them."""
        return ViewGraph(tuple(e for e in self.edges if e.source in nodes and e.target in nodes))

    @lazy
    def motions(self) -> dict[Node, dict[Node, Array]]:
        """``T_here_there`` by here, then there; of several edges the first."""
        found: dict[Node, dict[Node, Array]] = {}
        for edge in self.edges:
            back = se3.invert(edge.T_target_source)
            found.setdefault(edge.target, {}).setdefault(edge.source, edge.T_target_source)
            found.setdefault(edge.source, {}).setdefault(edge.target, back)
        return found

    def component(self, start: Node) -> list[Node]:
        """What the edges join to a node, itself included, breadth first."""
        return list(breadth_first(start, self.motions))

    def poses(self, root: Node) -> dict[Node, Array]:
        """Poses ``T_root_node`` (4, 4) of what the edges join to `root`, breadth first.

        Where the edges have loops, the first of the shortest ways counts.
        """
        poses = {root: np.eye(4)}
        for there, here in breadth_first(root, self.motions).items():
            if here is not None:
                poses[there] = se3.project(poses[here] @ self.motions[here][there])
        return poses

    def path(self, start: Node, end: Node) -> Loop | None:
        """The motion from one node to another along the fewest edges; None where no way leads.

        A new pair of the two would close a loop with it: of ``steps + 1`` edges.
        """
        came_from = breadth_first(start, self.motions)
        if end not in came_from or start not in self.motions:
            return None
        motion, steps, there = np.eye(4), 0, end
        while (here := came_from[there]) is not None:
            motion = motion @ self.motions[there][here]
            there, steps = here, steps + 1
        return Loop(motion, steps)

    def loop(self, source: View, target: View) -> Loop | None:
        """The motion ``T_target_source`` that the edges already tell; None where they do not.

        A merged model is reached by way of any of its views.
        """
        if not isinstance(target, Model):
            return self.path(source.name, target.name)
        for part in target.parts:
            found = self.path(source.name, part.view.name)
            if found is not None:
                return Loop(part.T_model_scan @ found.motion, found.steps)
        return None

    def spanning_tree(self, root: Node) -> ViewGraph:
        """The minimum spanning tree of what is joined to `root` (Prim 1957), by `Edge.cost`.

        Of the edges that lead out of the tree the best is added, and of equal ones the first.

        Raises
        ------
        InputError
            If a cost is not a number.
        """
        left = sorted(self.edges, key=lambda edge: edge.cost)
        if any(np.isnan(edge.cost) for edge in left):
            raise InputError("expected costs of edges to be numbers, got NaN")
        reached, chosen = {root}, list[Edge]()
        while leading := next(
            (e for e in left if (e.source in reached) != (e.target in reached)), None
        ):
            chosen.append(leading)
            reached |= {leading.source, leading.target}
        return ViewGraph(tuple(chosen))
