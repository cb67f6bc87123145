from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.geometry import se3
from mvreg.stages.augment.merge import (
    ConcatAugment,
    MergeAugment,
    Mode,
    mean_normals,
    merge,
    moved,
    same_side,
)
from mvreg.testing.compare import assert_unit
from mvreg.testing.views import overlap, plain_view, registration
from mvreg.types import Model, Scale

UP = np.array([0.0, 0.0, 1.0])
quick = settings(max_examples=60, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def rows(rng, count):
    """Positions, unit normals and descriptors of `count` points."""
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return [rng.normal(size=(count, 3)), normals, rng.normal(size=(count, 9))]


@quick
@given(rngs, st.integers(1, 12), st.integers(1, 12), st.booleans(), st.sampled_from(Mode))
def test_merging_counts(rng, ours, theirs, oriented, mode):
    """Q' = A + F + B: the model's without partner, the fused, the view's without partner."""
    own, other = rows(rng, ours), rows(rng, theirs)
    moving = rng.permutation(theirs)[: rng.integers(0, theirs + 1)]
    pairs = np.stack([moving, rng.integers(0, ours, size=len(moving))], axis=1)
    before = [array.copy() for array in (*own, *other)]
    found = merge(own, other, pairs, mode, oriented)
    taken = len(np.unique(pairs[:, 1]))
    fused = len(pairs) if mode is Mode.many else taken
    for array in found:
        assert len(array) == (ours - taken) + fused + (theirs - len(pairs))
    assert_unit(found[1])
    for array, old in zip((*own, *other), before, strict=True):
        np.testing.assert_array_equal(array, old)
    alone = ours - taken
    np.testing.assert_array_equal(found[0][:alone], np.delete(own[0], pairs[:, 1], axis=0))
    np.testing.assert_array_equal(found[2][alone + fused :], np.delete(other[2], moving, axis=0))


def test_many_and_group_by_hand():
    own = [np.array([[0.0, 0, 0], [9, 9, 9]]), np.tile(UP, (2, 1)), np.array([[1.0], [7]])]
    other = [np.array([[2.0, 0, 0], [4, 0, 0], [5, 5, 5]]), np.tile(UP, (3, 1)),
             np.array([[3.0], [5], [9]])]  # fmt: skip
    pairs = np.array([[0, 0], [1, 0]])
    points, _, values = merge(own, other, pairs, Mode.many, True)
    np.testing.assert_allclose(points, [[9, 9, 9], [1, 0, 0], [2, 0, 0], [5, 5, 5]])
    np.testing.assert_allclose(values[:, 0], [7, 2, 3, 9])
    points, _, values = merge(own, other, pairs, Mode.group, True)
    np.testing.assert_allclose(points, [[9, 9, 9], [1.5, 0, 0], [5, 5, 5]])
    np.testing.assert_allclose(values[:, 0], [7, 2.5, 9])


@quick
@given(rngs, st.booleans())
def test_means_of_normals_are_unit_and_lie_between(rng, oriented):
    own, other = rows(rng, 20)[1], rows(rng, 20)[1]
    found = mean_normals(own, other, oriented)
    assert_unit(found)
    cosine = (own * other).sum(axis=1)
    if not oriented:
        cosine = np.abs(cosine)
        np.testing.assert_allclose(found, mean_normals(own, -other, False))
    np.testing.assert_allclose((found * own).sum(axis=1), np.sqrt((1 + cosine) / 2), atol=1e-9)


def test_normals_that_cancel_leave_the_model_s():
    np.testing.assert_array_equal(mean_normals(UP[None], -UP[None], True), UP[None])
    np.testing.assert_array_equal(mean_normals(UP[None], -UP[None], False), UP[None])


def test_two_sides_of_something_thin_are_not_fused():
    pairs = np.array([[0, 0], [1, 1]])
    source = np.array([UP, -UP])
    target = np.array([UP, UP])
    np.testing.assert_array_equal(same_side(pairs, source, target, True), [[0, 0]])
    np.testing.assert_array_equal(same_side(pairs, source, target, False), pairs)


@quick
@given(rngs)
def test_moving_keeps_what_is_invariant(rng):
    view, motion = overlap().source, se3.random(rng, 100.0)
    there = moved(view, motion)
    assert_unit(there.normals)
    assert_unit(there.features.normals)
    np.testing.assert_array_equal(there.features.descriptors, view.features.descriptors)
    np.testing.assert_allclose(there.points, se3.apply(motion, view.points))
    back = moved(there, se3.invert(motion))
    np.testing.assert_allclose(back.features.keypoints, view.features.keypoints, atol=1e-9)
    np.testing.assert_allclose(back.features.normals, view.features.normals, atol=1e-9)


def sheets(gap=0.2):
    """Two flat grids that overlap by half, one `gap` above the other, and how they fit."""
    grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [0.0]), -1).reshape(-1, 3)
    target = plain_view("target", grid, Scale(2.0, 1.0), keypoints=100)
    source = plain_view("source", grid + np.array([5, 0, gap]), Scale(2.0, 1.0), keypoints=100)
    return Model.of(target), source, registration(source, target, np.eye(4), reach=0.5)


def test_concatenation_keeps_everything():
    model, source, found = sheets()
    answer = ConcatAugment()(model, source, found)
    np.testing.assert_array_equal(answer.points, np.concatenate([model.points, source.points]))
    assert len(answer.features.keypoints) == 200
    assert answer.members == ("target", "source")


@pytest.mark.parametrize("mode", Mode)
def test_merging_fuses_half_and_keeps_the_density(mode):
    model, source, found = sheets()
    assert len(found.pairs) == 50
    answer = MergeAugment(mode)(model, source, found)
    assert len(answer.points) == len(answer.features.keypoints) == 150
    heights = np.round(answer.points[:, 2], 9)
    assert {h: int((heights == h).sum()) for h in (0.0, 0.1, 0.2)} == {0.0: 50, 0.1: 50, 0.2: 50}
    assert answer.resolution == pytest.approx(1.0, abs=0.05)


def test_many_thickens_where_group_does_not():
    """Three source points on each target point."""
    model, source, _ = sheets(gap=0.0)
    triple = plain_view(
        "triple", np.concatenate([source.points + 0.1 * i * np.eye(3)[0] for i in range(3)]),
        Scale(2.0, 1.0),
    )  # fmt: skip
    found = registration(triple, model, np.eye(4), reach=0.25)
    many, group = (MergeAugment(mode)(model, triple, found) for mode in (Mode.many, Mode.group))
    assert len(found.pairs) == 150
    assert len(many.points) == 100 - 50 + 150 + 150
    assert len(group.points) == 100 + 150


def test_keypoints_are_fused_within_the_largest_trimmed_distance():
    model, source, found = sheets(gap=0.2)
    near = MergeAugment()(model, source, replace(found, trim_distance=0.3))
    far = MergeAugment()(model, source, replace(found, trim_distance=0.1))
    assert len(near.features.keypoints) == 150
    assert len(far.features.keypoints) == 200


@pytest.mark.parametrize("mode", Mode)
def test_a_view_merged_with_itself_adds_nothing(mode):
    view = overlap().source
    model = Model.of(view)
    answer = MergeAugment(mode)(model, view, registration(view, model, np.eye(4)))
    assert len(answer.points) == len(view.points)
    assert len(answer.features.keypoints) == len(view.features.keypoints)


def test_a_sheet_seen_from_below_is_another_surface():
    model, source, found = sheets()
    features = replace(source.features, normals=-source.features.normals)
    below = replace(source, normals=-source.normals, features=features)
    answer = MergeAugment()(model, below, found)
    assert len(answer.points) == len(answer.features.keypoints) == 200
    blind = replace(below, features=replace(features, oriented=False))
    assert len(MergeAugment()(model, blind, found).points) == 150
