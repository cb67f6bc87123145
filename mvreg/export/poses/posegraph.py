"""Poses and links as Open3D's pose graph."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from mvreg.export.placements import Component, Placements
from mvreg.export.poses.text import write_names
from mvreg.geometry import se3
from mvreg.report.run_folder import write_text
from mvreg.types import Array


def write_posegraph(folder: Path, component: Component, placements: Placements) -> list[str]:
    """``posegraph.json``: a node per scan, an edge per link; Open3D writes matrices by columns.

    The relative pose of an edge is that of the two final poses. What a link weighs is not known in
    Open3D's sense: the information matrix is the identity, the confidence the link's.
    """
    order = {name: index for index, name in enumerate(component.poses)}
    nodes = [_record("PoseGraphNode", pose=_by_columns(p)) for p in component.poses.values()]
    edges = []
    for link in component.links:
        relative = se3.invert(component.poses[link.target]) @ component.poses[link.source]
        edges.append(_record(
            "PoseGraphEdge", source_node_id=order[link.source], target_node_id=order[link.target],
            transformation=_by_columns(relative), information=_by_columns(np.eye(6)),
            uncertain=False, confidence=link.confidence,
        ))  # fmt: skip
    graph = _record("PoseGraph", nodes=nodes, edges=edges)
    write_text(folder / "posegraph.json", json.dumps(graph, indent=1) + "\n")
    write_names(folder / "posegraph_names.txt", component, placements)
    return []


def _record(kind: str, **content: Any) -> dict[str, Any]:
    return {"class_name": kind, "version_major": 1, "version_minor": 0, **content}


def _by_columns(matrix: Array) -> list[float]:
    return [float(value) for value in matrix.ravel(order="F")]
