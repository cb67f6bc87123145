import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.kernels import ransac
from mvreg.stages.propagate.consensus import ConsensusPropagate, triples
from mvreg.stages.propagate.match_sets import Spread
from mvreg.testing import overlap, pipeline
from mvreg.testing.reference.propagate import angles_to, band_pairs, best_of_each
from mvreg.types import Matches

quick = settings(max_examples=60, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)
lengths = st.lists(st.integers(0, 12).map(lambda n: n / 4), max_size=15).map(np.array)


@quick
@given(lengths, lengths, st.sampled_from([0.0, 0.25, 0.6, 5.0]))
def test_band_pairs_are_all_pairs_within_the_tolerance(wanted, have, tolerance):
    wanted, have = wanted.astype(float), have.astype(float)
    i, j = band_pairs(wanted, have, tolerance)
    table = np.abs(wanted[:, None] - have[None]) <= tolerance
    assert sorted(zip(i, j, strict=True)) == sorted(zip(*np.nonzero(table), strict=True))
    assert (np.diff(i) >= 0).all(), "grouped by i"


@quick
@given(rngs, st.integers(1, 30))
def test_the_best_of_each_group(rng, count):
    group, cost = rng.integers(0, 5, size=count), rng.normal(size=count)
    found = best_of_each(group, cost)
    assert list(group[found]) == sorted(set(group))
    for position in found:
        assert cost[position] == cost[group == group[position]].min()


def test_there_is_no_best_of_nothing():
    assert len(best_of_each(np.empty(0, dtype=int), np.empty(0))) == 0


@quick
@given(rngs)
def test_angles_are_the_same_in_every_frame(rng):
    normals = rng.normal(size=(8, 4, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    turned = normals @ se3.random(rng)[:3, :3].T
    signs = rng.choice([-1.0, 1.0], size=(8, 4, 1))
    for oriented in (True, False):
        angles = angles_to(normals, 3, oriented)
        assert angles.shape == (8, 4)
        np.testing.assert_allclose(angles_to(turned, 3, oriented), angles, atol=1e-6)
        np.testing.assert_allclose(angles[3], 0, atol=1e-7)
        assert angles.max() <= (np.pi if oriented else np.pi / 2)
    np.testing.assert_allclose(angles_to(signs * normals, 3, False), angles_to(normals, 3, False))


def consensus(source, target, tolerance, samples, rng):
    """The consensus of matched points (M, 3)."""
    both = np.stack([np.arange(len(source))] * 2, axis=1)
    draws = triples([len(source)], samples, rng)
    poses, agree = ransac.consensus(
        source, target, both, np.array([0, len(both)]), draws, tolerance
    )
    return (poses[0], np.flatnonzero(agree)) if agree.any() else None


def planted(rng, agreeing, outliers, noise=0.0):
    """Matched points of which `agreeing` follow one motion; and which, and the motion."""
    truth = se3.random(rng, 50.0)
    source = rng.uniform(-50, 50, size=(agreeing + outliers, 3))
    target = se3.apply(truth, source) + noise * rng.normal(size=source.shape)
    target[agreeing:] = rng.uniform(-100, 100, size=(outliers, 3))
    order = rng.permutation(len(source))
    return source[order], target[order], np.flatnonzero(order < agreeing), truth


@quick
@given(rngs, st.integers(8, 30), st.sampled_from([0, 5, 15]), st.sampled_from([0.0, 0.3]))
def test_consensus_finds_a_planted_motion_among_outliers(rng, agreeing, outliers, noise):
    source, target, known, truth = planted(rng, agreeing, outliers, noise)
    found = consensus(source, target, 3.0, 500, rng)
    assert found is not None
    assert set(known) <= set(found[1]) or noise > 0
    assert len(set(known) & set(found[1])) >= 0.7 * agreeing
    moved = np.linalg.norm(se3.apply(found[0], source) - se3.apply(truth, source), axis=1)
    assert moved.max() < (1e-6 if noise == 0 and outliers == 0 else 5.0)


def test_consensus_repeats_with_the_same_numbers(rng):
    source, target, _, _ = planted(rng, 10, 20)
    one, two = (consensus(source, target, 3.0, 100, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(one[0], two[0])
    np.testing.assert_array_equal(one[1], two[1])


@pytest.mark.parametrize(
    "source",
    [np.zeros((20, 3)), np.outer(np.arange(20.0), [1, 2, 3]), np.random.default_rng(0).normal(
        size=(3, 3)) * 50],
    ids=["one point", "a line", "three matches"],
)  # fmt: skip
def test_what_fixes_no_motion_has_no_consensus(source, rng):
    assert consensus(source, source + 1.0, 0.5, 100, rng) is None


def test_contradicting_matches_have_no_consensus(rng):
    source, target = rng.uniform(-100, 100, size=(2, 12, 3))
    assert consensus(source, target, 0.1, 300, rng) is None


def propagate(rng=0, **parameters):
    pair = overlap()
    seeds = pipeline().seed(pair.source, pair.target)
    stage = ConsensusPropagate(**parameters)
    return stage(pair.source, pair.target, seeds, np.random.default_rng(rng)), pair


def test_candidates_differ_and_come_best_first():
    found, _ = propagate(keep=6, separation=20.0)
    assert 1 < len(found) <= 6
    angles = [se3.rotation_angle(found.poses, pose) for pose in found.poses]
    apart = np.rad2deg(np.array(angles))[~np.eye(len(found), dtype=bool)]
    assert apart.min() >= 20.0
    alone, _ = propagate(keep=1)
    assert len(alone) == 1
    np.testing.assert_array_equal(alone.poses[0], found.poses[0])


def test_the_matches_of_a_candidate_support_it():
    found, pair = propagate()
    own, other = pair.source.features.keypoints, pair.target.features.keypoints
    for pose, matches in zip(found.poses, found.matches, strict=True):
        gaps = se3.apply(pose, own[matches[:, 0]]) - other[matches[:, 1]]
        assert len(matches) > 3
        # Inliers of the sample, to which the pose was fitted then.
        assert np.median(np.linalg.norm(gaps, axis=1)) < pair.source.scale.spacing


def test_a_seed_that_does_not_spread_is_given_up():
    many, pair = propagate()
    assert len(many) > 0
    none, _ = propagate(min_matches=len(pair.target.features.keypoints) + 2)
    assert len(none) == 0


def test_sets_of_matches():
    spread = Spread(np.arange(16).reshape(8, 2), np.array([0, 3, 4, 8]))
    assert len(spread) == 3 and spread.sizes.tolist() == [3, 1, 4]
    np.testing.assert_array_equal(spread[1], [[6, 7]])
    larger, part = spread.at_least(2), spread.part(slice(1, 3))
    assert larger.sizes.tolist() == [3, 4] and part.sizes.tolist() == [1, 4]
    np.testing.assert_array_equal(larger[1], spread[2])
    np.testing.assert_array_equal(part[1], spread[2])
    assert spread.at_least(0) is spread and not len(spread.at_least(5))


def test_spreading_starts_at_the_seed_and_keeps_distances():
    pair, stage = overlap(), ConsensusPropagate()
    seeds = pipeline().seed(pair.source, pair.target)
    own, other = pair.source.features.keypoints, pair.target.features.keypoints
    lengths = []
    for i, j in seeds.indices[:20]:
        found = stage.spread(pair.source, pair.target, np.array([[i, j]]))
        assert len(found) == 1
        spread = found[0]
        np.testing.assert_array_equal(spread[0], [i, j])
        assert len(set(spread[:, 1])) == len(spread), "each target keypoint is matched once"
        here = np.linalg.norm(own[spread[:, 0]] - own[i], axis=1)
        there = np.linalg.norm(other[spread[:, 1]] - other[j], axis=1)
        limit = stage.distance_tolerance * pair.source.scale.spacing
        assert (np.abs(here - there) <= limit + 1e-9).all()
        lengths.append(len(spread))
    assert max(lengths) > 10


def test_no_seeds_no_candidates(rng):
    pair = overlap()
    none = Matches(np.empty((0, 2), dtype=np.intp), np.empty(0))
    assert len(ConsensusPropagate()(pair.source, pair.target, none, rng)) == 0


@pytest.mark.parametrize(
    "parameters",
    [{"keep": 0}, {"samples": 0}, {"min_matches": 2}, {"quality_overlap": 0.0},
     {"quality_overlap": 1.1}],
)  # fmt: skip
def test_wrong_parameters_are_refused(parameters):
    (name,) = parameters
    with pytest.raises(InputError, match=f"propagate.*{name}"):
        ConsensusPropagate(**parameters)
