import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.geometry.boxes import near_boxes

rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)


@settings(max_examples=40, deadline=None)
@given(rngs, st.integers(0, 12), st.sampled_from([0.0, 0.1, 0.5, 5.0]))
def test_the_pairs_are_those_that_every_axis_brings_near(rng, count, reach):
    clouds = [rng.uniform(0, 3, size=3) + rng.uniform(size=(4, 3)) for _ in range(count)]
    expected = [
        (i, j)
        for i in range(count)
        for j in range(i + 1, count)
        if (clouds[i].min(axis=0) - clouds[j].max(axis=0) <= reach).all()
        and (clouds[j].min(axis=0) - clouds[i].max(axis=0) <= reach).all()
    ]
    assert (near_boxes(clouds, reach) if count else []) == expected


@pytest.mark.parametrize("axis", range(3))
def test_boxes_are_near_up_to_the_reach_and_no_farther(axis):
    cube = np.array([[0.0, 0, 0], [1, 1, 1]])
    for apart, near in ((0.0, True), (0.5, True), (0.5625, False), (1.0, False)):
        other = cube + (1 + apart) * np.eye(3)[axis]
        assert near_boxes([cube, other], 0.5) == [(0, 1)] * near
        assert near_boxes([other, cube], 0.5) == [(0, 1)] * near
