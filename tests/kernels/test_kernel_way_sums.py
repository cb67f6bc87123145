"""Contacts summed up, against sums over rows."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mvreg.kernels import checks, way_sums
from mvreg.testing.reference import way_sums as plain
from tests.kernels.test_kernel_joint import WAYS, flats, near, parts, quick, rngs, surfaces

SIZES = np.array([40, 50, 30])
BEGIN = np.array([0, *np.cumsum(SIZES)])


def drawn(rng, count):
    """Contacts of three surfaces, whether they are near each other or not."""
    ends = parts(rng, len(WAYS), count)
    many = np.repeat(SIZES[WAYS], np.diff(ends), axis=0)
    where = (rng.integers(0, many[:, column]).astype(np.intc) for column in range(2))
    return WAYS, ends, *where


@quick
@given(rngs, st.integers(0, 200), flats, st.sampled_from([0.3, 3.0, 1e9]))
def test_normal_equations(rng, count, flat, width):
    ones, compiled = surfaces(rng, *SIZES)
    motions = np.stack([near(rng) for _ in ones])
    known = rng.random((BEGIN[-1], 2)), rng.random((BEGIN[-1], 3)) * [1, 1e-6, 1]
    given = motions, *drawn(rng, count), BEGIN, *known, rng.normal(size=3), 1.7, flat, width
    found, expected = (
        way_sums.normal_equations(compiled, *given), plain.normal_equations(ones, *given)
    )  # fmt: skip
    np.testing.assert_allclose(found.normals, expected[0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.gradients, expected[1], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(found.normals, np.swapaxes(found.normals, 1, 2))


@quick
@given(rngs, st.integers(0, 200))
def test_known_at(rng, count):
    given = *drawn(rng, count), BEGIN, rng.random((BEGIN[-1], 2))
    np.testing.assert_allclose(way_sums.known_at(*given), plain.known_at(*given), rtol=1e-12)


def test_what_does_not_fit_is_refused(rng):
    _, compiled = surfaces(rng, *SIZES)
    one = {
        "motions": np.stack([np.eye(4)] * 3), "ways": np.array([[0, 1]]), "ends": [0, 2],
        "samples": [0, 39], "patches": [0, 49], "begin": BEGIN, "cells": np.ones((120, 2)),
        "fits": np.ones((120, 3)), "centre": np.zeros(3), "radius": 1.0, "flat": True, "width": 1.0,
    }  # fmt: skip
    way_sums.normal_equations(compiled, **one)
    for wrong, said in (
        ({"samples": [0, 40]}, "40 samples and 50 patches, got 40 and 49"),
        ({"patches": [-1, 0]}, "40 samples and 50 patches, got 0 and -1"),
        ({"ends": [0, 1, 2]}, "the ends of 1 ways"),
        ({"begin": BEGIN[:3]}, "where 3 surfaces begin and end, got 3"),
        ({"begin": np.array([0, 41, 90, 120])}, "room for 40 samples of surface 0, got 41"),
        ({"fits": np.ones((119, 3))}, r"fits: expected shape \(120, 3\)"),
        ({"radius": 0.0}, "radius: expected a positive"),
    ):
        with pytest.raises(ValueError, match=said):
            way_sums.normal_equations(compiled, **one | wrong)
    known = {key: one[key] for key in ("ways", "ends", "samples", "patches", "begin")}
    with pytest.raises(ValueError, match="40 samples and 50 patches, got 39 and 50"):
        way_sums.known_at(**known | {"patches": [0, 50]}, precisions=np.ones((120, 2)))


def test_places_are_c_integers():
    assert checks.places("x", [1, 2], "N").dtype == np.intc
    with pytest.raises(ValueError, match="expected 32 bits a number"):
        checks.places("x", [2**40], "N")
