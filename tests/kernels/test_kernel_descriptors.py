"""Nearest descriptors of other scans: the kernel against its reference."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.kernels.descriptors import DescriptorTree
from mvreg.testing.reference.descriptors import foreign


def drawn(seed: int, size: int, width: int, scans: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    spread = 2.0 ** -np.arange(width)
    return rng.normal(size=(size, width)) * spread, np.sort(rng.integers(0, scans, size))


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 1000),
    size=st.integers(0, 400),
    width=st.integers(1, 17),
    scans=st.integers(1, 9),
    count=st.integers(1, 8),
)
def test_the_nearest_of_others_are_found(seed, size, width, scans, count):
    rows, owners = drawn(seed, size, width, scans)
    which = np.arange(0, size, 3)
    wanted, _ = foreign(rows, owners, which, count)
    np.testing.assert_array_equal(DescriptorTree(rows, owners).foreign(which, count), wanted)


def test_slack_bounds_how_much_farther_what_is_found_may_be():
    rows, _ = drawn(1, 3000, 8, 1)
    owners = np.arange(3000)  # each a scan of its own: who owns it tells which row was found
    which = np.arange(0, 3000, 7)
    _, wanted = foreign(rows, owners, which, 5)
    found = DescriptorTree(rows, owners).foreign(which, 5, 1.0)
    got = ((rows[which, None] - rows[found]) ** 2).sum(axis=2)
    assert (got <= 4 * wanted * (1 + 1e-9)).all()
    assert (got > wanted * (1 + 1e-9)).any(), "the search was not any shorter"
    assert (np.diff(got, axis=1) >= 0).all()


def test_duplicates_and_equal_columns_are_no_trouble():
    rows, owners = np.ones((500, 3)), np.repeat(np.arange(5), 100)
    found = DescriptorTree(rows, owners).foreign(np.arange(500), 4)
    assert (found >= 0).all()
    assert (found != owners[:, None]).all()


@pytest.mark.parametrize("count", [0, 65])
def test_too_many_neighbours_are_refused(count):
    with pytest.raises(ValueError, match="1 to 64 neighbours"):
        DescriptorTree(np.zeros((2, 2)), np.arange(2)).foreign(np.arange(2), count)
