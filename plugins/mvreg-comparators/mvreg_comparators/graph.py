"""Trees within the view graph: the pairs that joining two of them implies."""

from __future__ import annotations

from collections.abc import Mapping

from mvreg.geometry import se3
from mvreg.types import Array, Edge


def crossing(
    first: Mapping[str, Array], second: Mapping[str, Array], edge: Edge
) -> dict[tuple[str, str], Array]:
    """The pairs that an edge implies between two trees that it joins, itself left out.

    Parameters
    ----------
    first, second : mappings of name to (4, 4) array
        ``T_target_view`` of the tree with the edge's target, ``T_source_view`` of that with its
        source, as `ViewGraph.poses` gives them.
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
