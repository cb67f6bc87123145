"""Samples of points that come piece by piece."""

from __future__ import annotations

import numpy as np

from mvreg.datasets.sample import ROOM, Sample, drawn

RNG = np.random.default_rng(3)


def test_that_a_sample_does_not_depend_on_the_pieces():
    points = RNG.normal(size=(10_000, 3))
    whole = Sample(500)
    whole.add(points)
    parts = Sample(500)
    for piece in np.array_split(points, [0, 3, 700, 4000, 9999]):
        parts.add(piece)
    np.testing.assert_array_equal(parts.points(), whole.points())
    np.testing.assert_array_equal(parts.points(), points[drawn(10_000, 500)])
    assert parts.count == 10_000
    few = Sample(500)
    few.add(points[:400])
    np.testing.assert_array_equal(few.points(), points[:400])
    halves = np.bincount(drawn(10_000, 500) // 1000, minlength=10)
    assert halves.min() > 25  # from all over the file


def test_that_hardly_more_is_held_than_is_wanted():
    sample = Sample(1000)
    for _ in range(200):
        sample.add(RNG.normal(size=(700, 3)))
        assert len(sample._points) <= (1 + ROOM) * 1000 + 1
    assert len(sample.points()) == 1000


def test_that_a_sample_goes_on_after_it_was_asked():
    points = RNG.normal(size=(4000, 3))
    sample = Sample(100)
    for piece in np.array_split(points, 7):
        before = sample.points()
        kept = before.copy()
        sample.add(piece)
        np.testing.assert_array_equal(before, kept)
    np.testing.assert_array_equal(sample.points(), points[drawn(4000, 100)])
