from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.errors import InputError
from mvreg.stages.seed.nearest import NearestSeed
from mvreg.testing import overlap
from mvreg.types import Features

rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def view_with(descriptors):
    """A view whose keypoints have these descriptors (K, D)."""
    view, count = overlap().source, len(descriptors)
    up = np.tile([0.0, 0.0, 1.0], (count, 1, 1))
    features = Features(np.zeros((count, 3)), up, descriptors, True)
    return replace(view, features=features)


@settings(max_examples=40, deadline=None)
@given(rngs, st.integers(1, 30), st.integers(1, 30), st.sampled_from([0.01, 0.3, 0.5, 1.0]))
def test_seeds_are_the_nearest_in_descriptor(rng, sources, targets, share):
    own, other = rng.normal(size=(sources, 9)), rng.normal(size=(targets, 9))
    found = NearestSeed(top_fraction=share)(view_with(own), view_with(other))
    table = np.linalg.norm(own[:, None] - other[None], axis=2)
    best = np.argsort(table.min(axis=1))[: int(np.ceil(share * sources))]
    np.testing.assert_array_equal(found.indices[:, 0], best)
    np.testing.assert_array_equal(found.indices[:, 1], table.argmin(axis=1)[best])
    np.testing.assert_allclose(found.distances, table.min(axis=1)[best])


def test_ties_keep_the_order_of_the_keypoints():
    found = NearestSeed(top_fraction=0.5)(view_with(np.zeros((7, 9))), view_with(np.ones((3, 9))))
    np.testing.assert_array_equal(found.indices[:, 0], [0, 1, 2, 3])


@pytest.mark.parametrize(("own", "other"), [(0, 5), (5, 0), (0, 0)])
def test_where_there_are_no_keypoints_there_are_no_seeds(own, other):
    found = NearestSeed()(view_with(np.zeros((own, 9))), view_with(np.zeros((other, 9))))
    assert len(found) == 0
    assert found.indices.shape == (0, 2)


@pytest.mark.parametrize("share", [0.0, -0.1, 1.01, float("nan")])
def test_a_share_is_a_share(share):
    with pytest.raises(InputError, match=r"seed\.top_fraction: expected a share in \(0, 1\]"):
        NearestSeed(top_fraction=share)
