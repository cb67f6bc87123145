"""Multi-scan refinement of others: pairs by ICP, and a pose graph over them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any

import numpy as np

import mvreg
from mvreg.geometry import se3
from mvreg.geometry.boxes import near_boxes
from mvreg.kernels import overlap
from mvreg.types import Array, View

#: How far apart points may be that correspond (resolutions): at first, as far as the poses are
#: spoilt, and at last.
REACH, LAST = 4.0, 2.0
#: Least share of the smaller scan that must fit: 0.3 in Open3D's reconstruction system.
FITTING = 0.3
#: Neighbours of a normal, or of a covariance: small_gicp's default.
NEIGHBOURS = 20
#: Of the optimisation, as in Open3D's tutorial "Multiway registration".
PRUNE, PREFERENCE = 0.25, 1.0
#: Iterations of ICP each time, enough to come to rest.
ITERATIONS = 100

Register = Callable[[Any, Any, Array, float], Array]


def open3d_graph(views: Sequence[View], poses: Mapping[str, Array]) -> dict[str, Array]:
    """Open3D: point-to-plane ICP of pairs, pose graph."""
    reg = mvreg.load_open3d().pipelines.registration

    def register(source: Any, target: Any, start: Array, reach: float) -> Array:
        stop = reg.ICPConvergenceCriteria(max_iteration=ITERATIONS)
        plane = reg.TransformationEstimationPointToPlane()
        found = reg.registration_icp(source, target, reach, start, plane, stop)
        return np.asarray(found.transformation)

    return _optimised(views, poses, [_cloud(view) for view in views], register)


def gicp_graph(views: Sequence[View], poses: Mapping[str, Array]) -> dict[str, Array]:
    """small_gicp: generalized ICP of pairs (Segal, Haehnel and Thrun 2009); Open3D's pose graph."""
    small_gicp, ready = import_module("small_gicp"), []
    for view in views:
        cloud = small_gicp.PointCloud(_points(view))
        tree = small_gicp.KdTree(cloud)
        small_gicp.estimate_normals_covariances(cloud, tree, NEIGHBOURS)
        ready.append((cloud, tree))

    def register(source: Any, target: Any, start: Array, reach: float) -> Array:
        (moved, _), (fixed, tree) = source, target
        found = small_gicp.align(
            fixed, moved, tree, start, registration_type="GICP",
            max_correspondence_distance=reach, max_iterations=ITERATIONS,
            rotation_epsilon=1e-6, translation_epsilon=1e-6 * reach,
        )  # fmt: skip
        return np.asarray(found.T_target_source)

    return _optimised(views, poses, ready, register)


#: Name of a peer: what refines poses in the first view's frame.
PEERS = {"Open3D": open3d_graph, "small_gicp": gicp_graph}


def _points(view: View) -> Array:
    return np.array(view.points if view.scan is None else view.scan.points)  # writeable, for Open3D


def _cloud(view: View) -> Any:
    open3d = mvreg.load_open3d()
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(_points(view)))
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    return cloud


def _optimised(
    views: Sequence[View], poses: Mapping[str, Array], ready: Sequence[Any], register: Register
) -> dict[str, Array]:
    """Pairs that touch, registered from where they are, and Open3D's global optimisation.

    Both peers have the same graph: Open3D's information matrices, of the pairs that fit. Every edge
    may be pruned, as of scans in no order.
    """
    reg = mvreg.load_open3d().pipelines.registration
    unit, motions = views[0].scale.resolution, [poses[view.name] for view in views]
    clouds, graph = [_cloud(view) for view in views], reg.PoseGraph()
    for motion in motions:
        graph.nodes.append(reg.PoseGraphNode(motion))
    corners = [
        np.stack(overlap.box(_points(view), motion))
        for view, motion in zip(views, motions, strict=True)
    ]
    for source, target in near_boxes(corners, REACH * unit):
        found = se3.invert(motions[target]) @ motions[source]
        for reach in (REACH * unit, LAST * unit):
            found = register(ready[source], ready[target], found, reach)
        ends = clouds[source], clouds[target], LAST * unit, found
        known = reg.get_information_matrix_from_point_clouds(*ends)
        fewest = min(len(_points(views[k])) for k in (source, target))
        if known[5, 5] >= FITTING * fewest:  # how many points correspond
            graph.edges.append(reg.PoseGraphEdge(source, target, found, known, uncertain=True))
    quiet = mvreg.load_open3d().utility
    with quiet.VerbosityContextManager(quiet.VerbosityLevel.Error):
        reg.global_optimization(
            graph, reg.GlobalOptimizationLevenbergMarquardt(),
            reg.GlobalOptimizationConvergenceCriteria(),
            reg.GlobalOptimizationOption(LAST * unit, PRUNE, PREFERENCE, 0),
        )  # fmt: skip
    ended = np.stack([node.pose for node in graph.nodes])
    ended = se3.invert(ended[0]) @ ended
    return {view.name: pose for view, pose in zip(views, ended, strict=True)}
