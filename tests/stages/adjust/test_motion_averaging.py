"""Averaging of exact and of spoilt relative motions, and the view graph that they come from."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.evaluation.pose_errors import pose_errors
from mvreg.geometry import se3
from mvreg.stages.adjust import view_graph
from mvreg.stages.adjust.dense import dense
from mvreg.stages.adjust.motion_averaging import (
    MotionAveraging,
    WeightedMotionAveraging,
    average,
)
from mvreg.surface.displacement import farthest
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.testing.adjust import nearly_right
from mvreg.testing.results import misplacement
from mvreg.testing.views import moved_view, registration
from mvreg.types import Edge, Model, Result
from mvreg.types.view_graph import reachable


def ring(count, rng, shift=100.0):
    """Exact poses of scans all around, the first at the origin."""
    motions = np.stack([se3.random(rng, shift) for _ in range(count)])
    return se3.invert(motions[0]) @ motions


def edge(motions, i, j, overlap=0.8, spoilt=None):
    relative = se3.invert(motions[i]) @ motions[j]
    return Edge(j, i, relative if spoilt is None else relative @ spoilt, overlap, 1.0)


def nudged(rng, angle=0.05, shift=1.0):
    axis, way = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
    return se3.exp(np.concatenate([angle * axis, shift * way]))


LOOP = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 0)]


def test_exact_motions_bring_a_drifted_pose_back(rng):
    truth = ring(5, rng)
    start = truth.copy()
    start[3] = start[3] @ nudged(rng, 0.3, 20.0)
    edges = [edge(truth, i, j) for i, j in LOOP]
    found, moved = average(start, edges, np.ones(5), 0)
    assert moved == {1, 2, 3, 4}
    np.testing.assert_allclose(found, truth, atol=1e-10 * 100)
    np.testing.assert_array_equal(found[0], truth[0])
    assert not np.array_equal(start[3], found[3]), "the start is not written to"


def test_exact_motions_recover_all_poses_from_far_away(rng):
    truth = ring(6, rng)
    start = np.stack([pose @ nudged(rng, 0.8, 60.0) for pose in truth])
    start[0] = truth[0]
    edges = [edge(truth, i, j) for i in range(6) for j in range(6) if i != j]
    found, _ = average(start, edges, np.ones(len(edges)), 0)
    np.testing.assert_allclose(found, truth, atol=1e-8)


@pytest.mark.parametrize("reference", [0, 2])
def test_the_reference_stays(rng, reference):
    truth = ring(5, rng)
    edges = [edge(truth, i, j, spoilt=nudged(rng)) for i, j in LOOP]
    found, moved = average(truth, edges, np.ones(5), reference)
    np.testing.assert_array_equal(found[reference], truth[reference])
    assert moved == set(range(5)) - {reference}


def test_the_error_of_a_loop_is_spread_evenly(rng):
    """Turns about one axis commute, so the answer is known: a fifth of the gap for each edge."""
    truth = np.stack([se3.exp(np.array([0, 0, 0.5 * k, 0, 0, 0])) for k in range(5)])
    gap = se3.exp(np.array([0, 0, 0.1, 0, 0, 0]))
    edges = [edge(truth, i, j) for i, j in LOOP[:-1]] + [edge(truth, 4, 0, spoilt=gap)]
    found, _ = average(truth, edges, np.ones(5), 0)
    left = [
        se3.log(se3.invert(found[e.target] @ e.T_target_source) @ found[e.source]) for e in edges
    ]
    np.testing.assert_allclose(np.abs(left)[:, 2], 0.1 / 5, rtol=1e-9)
    np.testing.assert_allclose(np.delete(left, 2, axis=1), 0, atol=1e-12)


def test_weights_pull_towards_what_is_reliable(rng):
    """Two measurements of one motion: the answer lies between them, nearer the heavier."""
    truth = np.stack([np.eye(4), np.eye(4)])
    off = se3.exp(np.array([0, 0, 0.1, 0, 0, 0]))
    edges = [edge(truth, 0, 1), edge(truth, 0, 1, spoilt=off)]
    for first, second in [(1.0, 1.0), (3.0, 1.0), (1.0, 9.0)]:
        found, _ = average(truth, edges, np.array([first, second]), 0)
        expected = 0.1 * second / (first + second)
        np.testing.assert_allclose(se3.log(found[1])[2], expected, rtol=1e-9)


def test_overlap_is_the_weight_of_the_weighted_average(rng):
    truth = ring(3, rng)
    edges = [edge(truth, 0, 1, 0.9), edge(truth, 1, 2, 0.55)]
    np.testing.assert_array_equal(MotionAveraging().weights(edges), [1, 1])
    np.testing.assert_array_equal(WeightedMotionAveraging().weights(edges), [0.9, 0.55])


def test_both_directions_of_a_pair_agree(rng):
    truth = ring(4, rng)
    start = truth.copy()
    start[2] = start[2] @ nudged(rng)
    one = [edge(truth, i, j) for i, j in [(0, 1), (1, 2), (2, 3)]]
    back = [edge(truth, e.source, e.target) for e in one]
    for edges in (one, back, one + back):
        np.testing.assert_allclose(average(start, edges, np.ones(6), 0)[0], truth, atol=1e-9)


def test_what_no_edge_joins_to_the_reference_keeps_its_pose(rng):
    truth = ring(5, rng)
    start = np.stack([truth[0], *(pose @ nudged(rng) for pose in truth[1:])])
    edges = [edge(truth, 0, 1), edge(truth, 2, 3), edge(truth, 3, 4)]
    found, moved = average(start, edges, np.ones(3), 0)
    assert moved == {1}
    np.testing.assert_allclose(found[1], truth[1], atol=1e-10)
    np.testing.assert_array_equal(found[2:], start[2:])
    assert average(start, edges[1:], np.ones(2), 0)[1] == set()
    assert average(start, [], np.ones(0), 0)[1] == set()


def test_reachable_views():
    pairs = [(1, 0), (1, 2), (4, 5)]
    assert reachable(pairs, 0) == {0, 1, 2}
    assert reachable(pairs, 5) == {4, 5}
    assert reachable(pairs, 3) == {3}


def exact():
    """The blob's views and their exact poses, the first the reference."""
    views, poses = blob_views(3), blob_scans(3).poses
    first = se3.invert(poses[views[0].name])
    exact = {view.name: first @ poses[view.name] for view in views}
    exact[views[0].name] = np.eye(4)
    return views, exact


class Perfect:
    """A pipeline whose refinement knows the truth, or is as wrong as the test says."""

    def __init__(self, poses, spoil=None):
        self.poses, self.spoil, self.asked = poses, spoil or {}, []

    def refine(self, source, target, T_init):
        self.asked.append((target.name, source.name, len(target.points)))
        pose = se3.invert(self.poses[target.name]) @ self.poses[source.name]
        off = self.spoil.get((target.name, source.name))
        return registration(source, target, pose if off is None else pose @ off)


def test_overlaps_are_what_the_views_share():
    views, poses = exact()
    shares = view_graph.overlaps(poses, views)
    np.testing.assert_array_equal(np.diag(shares), 0)
    # Neighbours are 40 degrees apart and share about four fifths; the ends are 80 apart.
    for i, j in [(0, 1), (1, 0), (1, 2), (2, 1)]:
        assert 0.65 < shares[i, j] < 0.95
        assert shares[i, j] > shares[0, 2] + 0.1
    np.testing.assert_allclose(shares, shares.T, atol=0.1)


def test_views_without_pose_or_contact_share_nothing():
    views, poses = exact()
    names = [view.name for view in views]
    away = se3.from_parts(np.eye(3), np.array([1e4, 0, 0]))
    partial = {name: poses[name] for name in names[:2]}
    assert view_graph.overlaps(partial, views)[2].tolist() == [0, 0, 0]
    apart = {**poses, names[2]: away @ poses[names[2]]}
    shares = view_graph.overlaps(apart, views)
    assert shares[2].max() == shares[:, 2].max() == 0
    assert shares[0, 1] > 0.6
    assert view_graph.overlaps({}, views).max() == 0


def test_a_view_given_twice_overlaps_itself_wholly():
    """Distances of zero must not make the pooled threshold zero for everybody else."""
    views, poses = exact()
    twin = replace(views[0], name="twin")
    shares = view_graph.overlaps({**poses, "twin": poses[views[0].name]}, [*views, twin])
    assert shares[0, 3] == shares[3, 0] == 1
    assert shares[0, 1] > 0.6


def test_edges_are_ordered_and_measured_from_the_poses_given():
    views, poses = exact()
    perfect = Perfect(poses)
    start = nearly_right()
    found = view_graph.edges(start, views, perfect.refine, 0.65)
    pairs = [(edge.target, edge.source) for edge in found]
    assert pairs == sorted(pairs)
    assert {(0, 1), (1, 0), (1, 2), (2, 1)} <= set(pairs)
    for one in found:
        truth = se3.invert(poses[views[one.target].name]) @ poses[views[one.source].name]
        np.testing.assert_allclose(one.T_target_source, truth, atol=1e-9)
        assert 0.65 < one.overlap <= 1
    assert view_graph.edges(start, views, perfect.refine, 0.999) == []


def test_targets_are_dense_unless_given():
    views, poses = exact()
    perfect = Perfect(poses)
    result = Result(views[0].name, poses, (), ())
    view_graph.edges(result, views, perfect.refine)
    assert {size for *_, size in perfect.asked} <= {len(view.scan.points) for view in views}
    perfect.asked.clear()
    view_graph.edges(result, views, perfect.refine, targets=views)
    assert {size for *_, size in perfect.asked} <= {len(view.points) for view in views}


def test_dense_views_have_all_the_points_and_their_normals():
    view = blob_views(3)[0]
    full = dense([view])[0]
    np.testing.assert_array_equal(full.points, view.scan.points)
    assert len(full.points) > len(view.points)
    assert full.resolution < view.resolution
    assert full.scale == view.scale
    _, own = full.tree.query(view.points)
    assert (np.einsum("ij,ij->i", full.normals[own], view.normals) > 0.99).all()
    bare = replace(view, scan=None)
    assert dense([bare])[0] is bare


@pytest.mark.parametrize("stage", [MotionAveraging(), WeightedMotionAveraging()])
def test_perfect_measurements_give_perfect_poses(stage):
    views, poses = exact()
    found = stage(replace(nearly_right(), model=Model.of(blob_views()[0])), views, Perfect(poses))
    assert pose_errors(found.poses, poses, found.reference).max.rotation < 1e-9
    assert found.model is None, "the merged model no longer fits"
    assert list(found.poses) == list(nearly_right().poses)


def test_the_real_refinement_makes_poses_better():
    views, poses = exact()
    start = nearly_right()
    found = MotionAveraging()(start, views, pipeline())
    before, after = (misplacement(x.poses, poses, views, x.reference) for x in (start, found))
    assert after < 0.5 * before


def test_wrong_measurements_are_refused():
    views, poses = exact()
    result = Result(views[0].name, poses, (), ())
    wrong = se3.exp(np.array([0.05, 0, 0, 0, 0, 0]))
    spoil = {(i.name, j.name): wrong for i in views for j in views}
    assert MotionAveraging()(result, views, Perfect(poses, spoil)) is result
    believed = MotionAveraging(guarded=False, max_rounds=1)(result, views, Perfect(poses, spoil))
    assert misplacement(believed.poses, poses, views, result.reference) > 0.5


def test_without_overlap_the_result_stays():
    views, poses = exact()
    result = nearly_right()
    away = {
        name: se3.from_parts(np.eye(3), np.array([1e4 * k, 0, 0])) @ pose
        for k, (name, pose) in enumerate(result.poses.items())
    }
    apart = replace(result, poses=away)
    assert MotionAveraging()(apart, views, Perfect(poses)) is apart
    assert MotionAveraging(max_rounds=0)(result, views, Perfect(poses)) is result


def test_a_scan_apart_keeps_its_pose_and_one_left_out_stays_out():
    views, poses = exact()
    names = [view.name for view in views]
    far = se3.from_parts(np.eye(3), np.array([1e4, 0, 0]))
    start = nearly_right()
    apart = replace(start, poses={**start.poses, names[2]: far})
    found = MotionAveraging()(apart, views, Perfect(poses))
    np.testing.assert_array_equal(found.poses[names[2]], far)
    np.testing.assert_allclose(found.poses[names[1]], poses[names[1]], atol=1e-9)
    partial = replace(
        start, poses={name: start.poses[name] for name in names[:2]}, unregistered=(names[2],)
    )
    found = MotionAveraging()(partial, views, Perfect(poses))
    assert list(found.poses) == names[:2]
    assert found.unregistered == (names[2],)


def test_the_farthest_point_counts():
    view = blob_views(3)[0]
    shift = se3.from_parts(np.eye(3), np.array([0, 3.0 * view.scale.resolution, 0]))
    names = {view.name: np.eye(4)}
    assert farthest([view], names, {view.name: shift}) == pytest.approx(3.0)
    assert farthest([moved_view(view, shift)], names, names) == 0


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"min_overlap": 1.0}, r"adjust\.min_overlap: expected a share in \[0, 1\), got 1\.0"),
        ({"min_overlap": -0.1}, "got -0.1"),
        ({"max_rounds": -1}, r"adjust\.max_rounds: expected 0 or more, got -1"),
    ],
)
def test_parameters_out_of_range_are_refused(parameters, message):
    with pytest.raises(InputError, match=message):
        WeightedMotionAveraging(**parameters)
