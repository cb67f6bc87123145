"""The spread of descriptors, which tolerances on their distances are relative to."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mvreg
from mvreg.errors import RecordError
from mvreg.evaluation.pose_errors import pose_errors
from mvreg.stages.augment.merge import ConcatAugment, MergeAugment
from mvreg.stages.describe.spectrum import SPREAD
from mvreg.stages.propagate.consensus import ConsensusPropagate
from mvreg.testing import overlap, pipeline
from mvreg.testing.views import registration
from mvreg.types import Features, Model, common_spread, estimated_spread


def features(descriptors, spread=None):
    count = len(descriptors)
    normals = np.tile([0.0, 0, 1], (count, 1, 1))
    return Features(np.zeros((count, 3)), normals, np.asarray(descriptors, float), True, spread)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([2.0**-20, 0.5, 2.0**30]))
def test_the_estimate_grows_with_the_descriptors_and_ignores_their_order(number, factor):
    rng = np.random.default_rng(number)
    rows = rng.normal(size=(rng.integers(1, 40), rng.integers(1, 9)))
    assert estimated_spread(rows * factor) == estimated_spread(rows) * factor
    assert estimated_spread(rng.permutation(rows)) == estimated_spread(rows)
    np.testing.assert_allclose(estimated_spread(rows + 3), estimated_spread(rows), rtol=1e-9)


def test_the_estimate_holds_three_quarters_whatever_a_few_others_are():
    rows = np.random.default_rng(0).normal(size=(1000, 3))
    spread = estimated_spread(rows)
    away = np.linalg.norm(rows - np.median(rows, axis=0), axis=1)
    assert (away <= spread).mean() == pytest.approx(0.75, abs=0.01)
    rows[:100] = 1e9
    assert estimated_spread(rows) == pytest.approx(spread, rel=0.25)


@pytest.mark.parametrize("rows", [np.empty((0, 3)), np.empty((0, 0)), np.ones((5, 3))])
def test_no_descriptors_and_descriptors_all_alike_have_no_spread(rows):
    assert estimated_spread(rows) == 0.0
    assert features(rows).descriptor_spread == 0.0


def test_what_is_declared_counts_and_is_common_to_both_sides():
    small, large = features([[0.0], [1.0], [2.0]]), features([[0.0], [10.0], [20.0]])
    assert features([[0.0], [1.0]], 7.0).descriptor_spread == 7.0
    assert common_spread(features([[1.0]], 0.2), features([[3.0]], 0.2)) == 0.2
    both = common_spread(small, large)
    assert both == common_spread(large, small)
    assert small.descriptor_spread < both < large.descriptor_spread
    assert common_spread(features(np.ones((3, 2))), features(np.ones((3, 2)))) == np.inf


def test_the_papers_descriptor_is_matched_as_tolerantly_as_it_was():
    """Bit for bit: whoever does not choose another descriptor sees no change."""
    pair = overlap()
    assert pair.source.features.spread == SPREAD
    spread = common_spread(pair.source.features, pair.target.features)
    assert ConsensusPropagate().descriptor_tolerance * spread == 0.2


@pytest.mark.parametrize("augment", [ConcatAugment(), MergeAugment()])
def test_a_model_declares_what_all_its_views_declare(augment):
    pair = overlap()
    found = registration(pair.source, pair.target, pair.T_target_source)
    other = replace(pair.source, features=replace(pair.source.features, spread=None))
    model = Model.of(pair.target)
    assert augment(model, pair.source, found).features.spread == SPREAD
    assert augment(model, other, found).features.spread is None


def test_descriptors_all_alike_exclude_nothing():
    """Geometry alone then decides, as a plugin without descriptors may want it."""
    pair, stage = overlap(), ConsensusPropagate()
    seeds = pipeline().seed(pair.source, pair.target).indices
    blank = [
        replace(view, features=replace(view.features, descriptors=np.ones((len(
            view.features.keypoints), 1)), spread=None))
        for view in (pair.source, pair.target)
    ]  # fmt: skip
    wide = replace(stage, descriptor_tolerance=1e9).spread(pair.source, pair.target, seeds)
    np.testing.assert_array_equal(stage.spread(*blank, seeds).matches, wide.matches)


@pytest.mark.parametrize("describe", ["eigenvalues", "fpfh"])
def test_other_descriptors_place_what_the_papers_does(describe):
    if describe == "fpfh":
        pytest.importorskip("mvreg_fpfh")
    scans = mvreg.dataset("tiny")
    result = mvreg.register(scans, changes={"describe": describe})
    errors = pose_errors(result.poses, scans.poses, result.reference)
    assert len(result.poses) == 6
    assert errors.max.angle < 1


@pytest.mark.parametrize(
    ("field", "wrong"),
    [
        ("keypoints", np.zeros((3, 2))),
        ("normals", np.zeros((3, 1, 3))),
        ("normals", np.tile([0.0, 0, 1], (2, 1, 1))),
        ("descriptors", np.full((3, 2), np.nan)),
        ("descriptors", np.zeros((2, 2))),
        ("oriented", "yes"),
        ("spread", -0.2),
        ("spread", 0.0),
        ("spread", np.inf),
    ],
)
def test_features_that_cannot_be_are_refused(field, wrong):
    good = features(np.zeros((3, 2)), 0.2)
    with pytest.raises(RecordError, match=rf"^Features\.{field}: expected"):
        replace(good, **{field: wrong})
