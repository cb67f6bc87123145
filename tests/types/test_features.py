"""The spread of descriptors: declared, or estimated from them."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.stages.describe.spectrum import SpectrumDescribe
from mvreg.testing import DescribeContract
from mvreg.types import Features
from mvreg.types.view import COMPARED, typical_distance


class Undeclared(SpectrumDescribe):
    """The spread is estimated from each view's own descriptors."""

    def __call__(self, scan, keypoints, spacing):
        return replace(super().__call__(scan, keypoints, spacing), declared_spread=None)


class TestUndeclared(DescribeContract):
    stage = Undeclared()


def features(descriptors, **declared):
    count = len(descriptors)
    normals = np.tile([0.0, 0, 1], (count, 1, 1))
    return Features(np.zeros((count, 3)), normals, descriptors, False, **declared)


def test_what_is_declared_is_believed(rng):
    assert features(rng.normal(size=(5, 2)), declared_spread=0.5).spread == 0.5


def test_the_estimate_is_the_median_distance_of_two(rng):
    descriptors = rng.normal(size=(60, 9))
    apart = np.linalg.norm(descriptors[:, None] - descriptors, axis=2)
    expected = np.median(apart[np.triu_indices(60, 1)])
    assert features(descriptors).spread == pytest.approx(expected, rel=1e-12)


def test_the_estimate_of_many_is_about_that_of_all(rng):
    """Normal in 9 dimensions: the median of sqrt(2 chi^2_9) is 4.08."""
    assert features(rng.normal(size=(40 * COMPARED, 9))).spread == pytest.approx(4.08, rel=0.05)


@pytest.mark.parametrize("count", [2, 30, 3 * COMPARED + 1])
def test_it_scales_with_the_descriptors_and_ignores_their_order(rng, count):
    descriptors = rng.normal(size=(count, 4))
    found = typical_distance(descriptors)
    assert typical_distance(1024 * descriptors) == 1024 * found
    assert typical_distance(rng.permutation(descriptors)) == found
    assert typical_distance(descriptors + 3.0) == pytest.approx(found)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_descriptors_that_are_all_alike_have_a_spread(count):
    assert features(np.ones((count, 9))).spread == 1.0


def test_descriptors_most_of_which_are_alike_have_a_spread():
    descriptors = np.zeros((10, 3))
    descriptors[0] = 4.0
    assert 0 < features(descriptors).spread < 7
