"""Each compiled kernel against its reference."""

import pickle
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from mvreg.geometry import se3
from mvreg.kernels import descriptor_matches, grid, icp, moments, propagate, ransac, trimmed_pairs
from mvreg.kernels.tree import Tree
from mvreg.stages.propagate.consensus import triples
from mvreg.stages.refine.plane_base import PlaneICP
from mvreg.stages.refine.planes import PointToPlane
from mvreg.testing import overlap, pipeline
from mvreg.testing.reference import grid as plain_grid
from mvreg.testing.reference import icp as plain_icp
from mvreg.testing.reference import moments as plain_moments
from mvreg.testing.reference import propagate as plain_propagate
from mvreg.testing.refine import nudge

quick = settings(max_examples=60, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)
clouds = st.sampled_from(["surface", "line", "grid", "one point"])
bounds = st.sampled_from([0.0, 0.02, 0.2, 1e9, np.inf])


def cloud(kind, count, rng):
    points = rng.uniform(-1, 1, size=(count, 3))
    if kind == "surface":
        return points / np.linalg.norm(points, axis=1, keepdims=True)
    if kind == "line":
        return points[:, :1] * [1.0, 2.0, -3.0]
    return np.round(2 * points) if kind == "grid" else np.zeros((count, 3))


@quick
@given(rngs, clouds, st.integers(0, 300), st.integers(1, 30), bounds)
def test_the_tree_finds_what_scipy_finds(rng, kind, count, k, bound):
    points, queries = cloud(kind, count, rng), rng.normal(size=(40, 3))
    if count == 0:
        distances, indices = Tree(points).query(queries, k, bound)
        assert np.isinf(distances).all() and (indices == 0).all()
        return
    expected = cKDTree(points).query(queries, list(range(1, k + 1)), distance_upper_bound=bound)[0]
    distances, indices = Tree(points).query(queries, list(range(1, k + 1)), bound)
    np.testing.assert_allclose(distances, expected, rtol=1e-13)
    found = indices < count
    np.testing.assert_array_equal(found, np.isfinite(expected))
    rows = np.nonzero(found)[0]
    np.testing.assert_allclose(
        np.linalg.norm(points[indices[found]] - queries[rows], axis=1), distances[found]
    )
    for row, kept in zip(indices, found, strict=True):
        assert len(set(row[kept])) == kept.sum(), "no neighbour twice"
    nearest, which = Tree(points).nearest(queries, bound)
    np.testing.assert_array_equal(nearest, distances[:, 0])
    assert ((which == count) == ~found[:, 0]).all()


def test_the_tree_knows_its_box_and_can_be_sent_away(rng):
    points = rng.normal(size=(100, 3))
    tree = pickle.loads(pickle.dumps(Tree(points)))
    np.testing.assert_array_equal(tree.mins, points.min(axis=0))
    np.testing.assert_array_equal(tree.maxes, points.max(axis=0))
    np.testing.assert_array_equal(tree.data, points)
    assert tree.n == 100


@pytest.mark.parametrize("shape", [(5, 2), (5,), (2, 2, 3)])
def test_a_tree_needs_points_in_space(shape):
    with pytest.raises(ValueError, match=r"\(N, 3\)"):
        Tree(np.zeros(shape))
    with pytest.raises(ValueError, match="neighbours"):
        Tree(np.zeros((5, 3))).query(np.zeros((2, 3)), 200)


@quick
@given(rngs, clouds, st.integers(1, 200), st.integers(1, 6))
def test_moments(rng, kind, count, shells):
    points, keypoints = cloud(kind, count, rng), rng.uniform(-1, 1, size=(7, 3))
    radii = np.sort(rng.uniform(0.1, 1.5, size=shells))
    found = moments.moments(Tree(points), keypoints, radii)
    for one, expected in zip(found, plain_moments.moments(points, keypoints, radii), strict=True):
        np.testing.assert_allclose(one, expected, atol=1e-12)


@quick
@given(rngs, st.integers(3, 25))
def test_normals(rng, count):
    points = cloud("surface", 400, rng)
    found = moments.normals(Tree(points), points[:50], count)
    expected = plain_moments.normals(points, points[:50], count)
    np.testing.assert_allclose(np.abs((found * expected).sum(axis=1)), 1, atol=1e-9)


def test_normals_of_what_makes_no_plane_are_some_unit_vectors():
    for points in (np.zeros((5, 3)), np.ones((1, 3)), np.outer(np.arange(9.0), [1, 2, 3])):
        found = moments.normals(Tree(points), points, 20)
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)


@quick
@given(rngs, clouds, st.integers(1, 400), st.sampled_from([1e-3, 0.1, 0.7, 50.0]))
def test_cells(rng, kind, count, step):
    points = cloud(kind, count, rng)
    found = grid.Cells(points, step)
    sizes, means, cell = plain_grid.cells(points, step)
    np.testing.assert_array_equal(found.sizes, sizes)
    np.testing.assert_array_equal(found.cell, cell)
    np.testing.assert_allclose(found.means, means, atol=1e-15)


def test_that_the_table_of_cells_grows_with_them(rng):
    points = rng.uniform(size=(40_000, 3))
    found = grid.Cells(points, 0.03)
    sizes, means, cell = plain_grid.cells(points, 0.03)
    assert len(sizes) > 20_000
    np.testing.assert_array_equal(found.sizes, sizes)
    np.testing.assert_array_equal(found.cell, cell)
    np.testing.assert_allclose(found.means, means, atol=1e-15)


def test_a_grid_too_fine_to_be_counted_keeps_every_point(rng):
    points = rng.uniform(size=(500, 3))
    found = grid.Cells(points, 1e-12)
    assert found.sizes.sum() == 500 and len(found.sizes) > 490


starts = st.tuples(st.sampled_from([0.0, 4.0, 25.0, 150.0]), st.sampled_from([0.0, 2.0, 12.0]))
shares = st.sampled_from([0.05, 0.4, 0.77, 1.0])


@pytest.mark.parametrize("noise", [0.0, 1e-14, 1e-9, 1e-3])
def test_trimmed_pairs_are_in_order_where_all_are_equally_far(rng, noise):
    grid = np.stack(np.meshgrid(np.arange(50.0), np.arange(50.0), [0.0]), axis=-1).reshape(-1, 3)
    above = grid + np.array([0, 0, 0.3]) + rng.normal(0, noise, grid.shape)
    chosen, targets, distances, _, _ = trimmed_pairs.trimmed(Tree(grid), above, 2.0, 0.4, 3.0)
    order = np.argsort(np.linalg.norm(above - grid, axis=1), kind="stable")
    assert (np.diff(distances) >= 0).all()
    assert (targets == chosen).all()
    if noise > 1e-12:  # below that, the sums' rounding orders them
        np.testing.assert_array_equal(chosen, order[: len(chosen)])


@pytest.mark.parametrize("count", [1000, 2999, 6000])
def test_a_helper_changes_no_answer(rng, count):
    points = np.column_stack([rng.uniform(0, 9, (count, 2)), np.zeros(count)])
    points[:, 2] = np.sin(points[:, 0]) * np.cos(points[:, 1])
    begin = se3.from_parts(np.eye(3), np.array([0.1, -0.2, 0.3]))
    kept, tree = points[: count - 200], Tree(points[100:])
    normals = np.tile([0.0, 0.0, 1.0], (count - 100, 1))
    for search in (
        lambda helped: icp.trimmed_icp(
            tree, kept, begin, 0.5, 1e-9, 0.4, 3.0, 50, 1e-6, helped=helped
        ),
        lambda helped: icp.plane_icp(
            tree, normals, kept, begin, 0.5, 1e-9, 0.4, 2.0, 50, 1e-6, 1.0, helped=helped
        ),
    ):
        alone, together = search(False), search(True)
        assert alone[2] > 3
        np.testing.assert_array_equal(alone[0], together[0])
        for one, other in zip(alone[1], together[1], strict=True):
            np.testing.assert_array_equal(one, other)
        assert alone[2:] == together[2:]


@quick
@given(rngs, starts, shares, st.sampled_from([1.0, 1.9, 3.0]), st.sampled_from([1e-3, 1.0, 1e9]))
def test_trimmed_pairs(rng, start, share, power, bound):
    pair = overlap()
    points = pair.source.points[rng.permutation(len(pair.source.points))[:80]]
    moved = se3.apply(pair.T_target_source @ nudge(pair.source, *start), points)
    found = trimmed_pairs.trimmed(pair.target.tree, moved, bound, share, power)
    expected = plain_icp.trimmed(pair.target.points, moved, share, power)
    for one, other in zip(found[:3], expected[:3], strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13)
    assert found[3] == pytest.approx(expected[3], rel=1e-12)


@quick
@given(starts, shares, st.sampled_from([1.0, 3.0]), st.integers(0, 8))
def test_trimmed_icp(start, share, power, iterations):
    """Step by step; after many steps rounding may lead another way."""
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, *start)
    points, spacing = pair.source.points, pair.source.scale.spacing
    options = (share, power, iterations, 1e-6)
    found = icp.trimmed_icp(pair.target.tree, points, begin, spacing, 1e-9 * spacing, *options)
    expected = plain_icp.trimmed_icp(pair.target.points, points, begin, *options)
    np.testing.assert_allclose(found[0], expected[0], atol=1e-6 * spacing)
    assert found[1][3] == pytest.approx(expected[1][3], rel=1e-6)
    assert found[2:] == expected[2:]


@pytest.mark.parametrize("start", [(4.0, 2.0), (25.0, 12.0)])
def test_trimmed_icp_comes_to_rest_where_its_reference_does(start):
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, *start)
    options = (0.4, 3.0, 200, 1e-9)
    found = icp.trimmed_icp(pair.target.tree, pair.source.points, begin, 1.0, 1e-9, *options)
    expected = plain_icp.trimmed_icp(pair.target.points, pair.source.points, begin, *options)
    assert found[3] and expected[3]
    assert found[1][3] == pytest.approx(expected[1][3], rel=1e-4)


@quick
@given(starts, st.integers(0, 30))
def test_plane_icp(start, iterations):
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, *start)
    stage = PointToPlane(max_iterations=iterations)
    pose, pairs, *ending = stage.iterate(pair.source, pair.target, begin)
    expected, others, *end = PlaneICP.iterate(stage, pair.source, pair.target, begin)
    np.testing.assert_allclose(pose, expected, atol=1e-6 * pair.source.scale.spacing)
    assert pairs.objective == pytest.approx(others.objective, rel=1e-6)
    assert ending == end


@pytest.mark.parametrize("oriented", [True, False])
@pytest.mark.parametrize(("angle", "step"), [(2.0, 1), (10.0, 1), (10.0, 3), (60.0, 1)])
def test_spread(oriented, angle, step, rng):
    pair = overlap()
    own, other = pair.source.features, pair.target.features
    if not oriented:
        signs = rng.choice([-1.0, 1.0], size=own.normals.shape[:2])[..., None]
        own = SimpleNamespace(
            keypoints=own.keypoints, normals=signs * own.normals, descriptors=own.descriptors,
            oriented=False,
        )  # fmt: skip
    seeds = pipeline().seed(pair.source, pair.target).indices
    shapes = [propagate.Shape(x.keypoints, x.normals, x.descriptors) for x in (own, other)]
    limits = (0.5 * pair.source.scale.spacing, np.deg2rad(angle), 0.2, step)
    matches, ends = propagate.spread(*shapes, seeds, oriented, *limits)
    found = np.split(matches, ends[1:-1])
    expected = [plain_propagate.spread(own, other, seed, *limits) for seed in seeds]
    same = [np.array_equal(one, two) for one, two in zip(found, expected, strict=True)]
    assert np.mean(same) > 0.99, "angles are good to 2e-8 only"
    assert max(len(matches) for matches in found) > 20 / step
    assert all((one[0] == seed).all() for one, seed in zip(found, seeds, strict=True))


@quick
@given(rngs, st.integers(0, 30), st.integers(1, 40), st.integers(1, 12))
def test_nearest_rows(rng, queries, count, length):
    own, other = rng.normal(size=(queries, length)), rng.normal(size=(count, length))
    found = descriptor_matches.Rows(other).nearest(own)
    expected = plain_propagate.nearest_rows(own, other)
    np.testing.assert_allclose(found[0], expected[0])
    np.testing.assert_array_equal(found[1], expected[1])
    same = descriptor_matches.Rows(np.repeat(other, 2, axis=0)).nearest(own)
    np.testing.assert_array_equal(same[1], 2 * found[1])


@quick
@given(rngs, st.integers(3, 60), st.floats(0, 1), st.sampled_from([1e-3, 0.2, 2.0]))
def test_consensus(rng, count, share, tolerance):
    source = rng.uniform(-5, 5, size=(count, 3))
    target = se3.apply(se3.random(rng, 9.0), source) + 0.1 * rng.normal(size=source.shape)
    target[: int(share * count)] = rng.uniform(-9, 9, size=(int(share * count), 3))
    (draws,) = triples([count], 100, rng)
    both = np.stack([np.arange(count)] * 2, axis=1)
    sets = np.concatenate([both, both[: count // 2], both])
    ends = np.array([0, count, count + count // 2, len(sets)])
    some = triples([count // 2], 100, rng)[0] if count > 5 else np.zeros((100, 3), dtype=np.intp)
    poses, agree = ransac.consensus(
        source, target, sets, ends, np.stack([draws, some, draws]), tolerance
    )
    expected = plain_propagate.consensus(source, target, draws, tolerance)
    for pose, mask in ((poses[0], agree[:count]), (poses[2], agree[ends[2] :])):
        assert mask.any() == (expected is not None)
        if expected is not None:
            np.testing.assert_array_equal(np.flatnonzero(mask), expected[1])
            np.testing.assert_allclose(pose, expected[0], atol=1e-9)


def test_samples_are_of_three_different_matches(rng):
    drawn, others = triples([4, 3], 3000, rng)
    assert (np.sort(others, axis=1) == [0, 1, 2]).all()
    assert (np.sort(drawn, axis=1)[:, 1:] > np.sort(drawn, axis=1)[:, :-1]).all()
    counts = np.unique(drawn, axis=0, return_counts=True)[1]
    assert len(counts) == 24 and counts.min() > 80, "every order of every three, about as often"


@quick
@given(rngs, clouds, clouds, st.integers(1, 30), st.integers(1, 40), shares)
def test_trimmed_icp_comes_to_an_end_whatever_the_points(rng, kind, other, size, count, share):
    """Also on points that coincide, or lie on the target's."""
    points, target = cloud(kind, size, rng), cloud(other, count, rng)
    for bound in (1e-9, 1.0):
        found = icp.trimmed_icp(Tree(target), points, np.eye(4), bound, 1e-12, share, 3.0, 20, 1e-6)
        expected = plain_icp.trimmed(target, se3.apply(found[0], points), share, 3.0)
        assert found[1][3] == pytest.approx(expected[3], rel=1e-6, abs=1e-20)
