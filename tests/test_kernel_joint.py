"""The kernels of the joint refinement against their reference."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg import se3
from mvreg.kernels import joint
from mvreg.kernels.reference import joint as plain
from mvreg.kernels.tree import Tree
from mvreg.stages.joint_spread import axes_about

quick = settings(max_examples=60, deadline=None)
rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)
flats = st.booleans()


def sphere(rng, count):
    points = rng.normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def surface(rng, count, patchy=True):
    """Patches about points of a unit sphere, for the reference and for the kernels."""
    points = sphere(rng, count)
    bends = rng.normal(size=(count, 3))
    slopes = 0.2 * rng.normal(size=(count, 2))
    axes = axes_about(points)
    upright = np.column_stack([-slopes, np.ones(count)])
    normals = np.einsum("mi,mij->mj", upright, axes)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    whole = rng.random(count) < (0.8 if patchy else 2)
    reach = rng.uniform(0.05, 0.4, size=count)
    one = plain.Patches(points, axes, slopes, bends, normals, reach, whole)
    return one, joint.Patches(Tree(points), points, axes, slopes, bends, normals, reach, whole)


def near(rng, turn=0.3):
    """A small motion."""
    return se3.exp(turn * rng.normal(size=6))


@quick
@given(rngs, st.integers(0, 50), flats)
def test_gaps(rng, count, flat):
    one, patches = surface(rng, 30)
    which = rng.integers(0, 30, size=count)
    points = one.points[which] + 0.1 * rng.normal(size=(count, 3))
    found = joint.gaps(patches, points, which, flat)
    for mine, other in zip(found, plain.gaps(one, points, which, flat), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-12)


@quick
@given(
    rngs, st.integers(0, 300), st.sampled_from([0.01, 0.2, 1e200, np.inf]), st.integers(1, 9),
    flats, st.booleans(),
)  # fmt: skip
def test_contacts(rng, count, reach, stride, flat, oriented):
    (one, source), (other, target) = surface(rng, count), surface(rng, 200)
    motion = near(rng, rng.choice([0.01, 0.3, 3.0]))
    options = (motion, reach, stride, flat, 0.7, oriented)
    found = joint.contacts(source, target, *options)
    for mine, expected in zip(found, plain.contacts(one, other, *options), strict=True):
        np.testing.assert_array_equal(mine, expected)


def test_contacts_are_found_at_all(rng):
    (_, source), (_, target) = surface(rng, 2000), surface(rng, 2000)
    flat = joint.contacts(source, target, np.eye(4), 0.3, 1, True, 0.7, True)
    assert 500 < len(flat[0]) < 1700
    curved = joint.contacts(source, target, np.eye(4), 0.3, 1, False, 0.7, True)
    assert 300 < len(curved[0]) < 1700
    turned = se3.exp(np.array([np.pi, 0, 0, 0, 0, 0]))
    assert len(joint.contacts(source, target, turned, 0.3, 1, True, 0.7, True)[0]) > 500
    far = se3.from_parts(np.eye(3), np.array([5.0, 0, 0]))
    assert not len(joint.contacts(source, target, far, 0.3, 1, True, 0.7, True)[0])


def test_nothing_lies_on_a_surface_without_patches(rng):
    (_, source), (_, none) = surface(rng, 20), surface(rng, 0)
    for found in (
        joint.contacts(source, none, np.eye(4), 9.0, 1, True, 0.7, True),
        joint.contacts(none, source, np.eye(4), 9.0, 1, True, 0.7, True),
    ):
        assert [one.shape for one in found] == [(0,), (0,)]


@quick
@given(rngs, st.integers(0, 60), flats)
def test_rows(rng, count, flat):
    (one, source), (other, target) = surface(rng, 40), surface(rng, 50)
    samples, patches = rng.integers(0, 40, size=count), rng.integers(0, 50, size=count)
    options = (near(rng), near(rng), samples, patches, rng.normal(size=3), 1.7, flat)
    found = joint.rows(source, target, *options)
    for mine, expected in zip(found, plain.rows(one, other, *options), strict=True):
        np.testing.assert_allclose(mine, expected, atol=1e-11)


@quick
@given(rngs, st.integers(0, 200), st.sampled_from([1e-3, 1.0, 1e9]))
def test_normal_equations(rng, count, width):
    values = (rng.normal(size=(count, 6)), rng.normal(size=count), rng.random(count), width, 3.0)
    found, expected = joint.normal_equations(*values), plain.normal_equations(*values)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(found[0], found[0].T)


@quick
@given(rngs, st.integers(0, 200), st.sampled_from([1e-3, 1.0, 1e9]), st.sampled_from([0.1, 9.0]))
def test_cell_sums(rng, count, width, edge):
    values = (rng.normal(size=(count, 6)), rng.normal(size=count), rng.random(count))
    points = rng.uniform(-1, 1, size=(count, 3))
    grid = (np.full(3, -1.0), edge, np.full(3, int(2 / edge) + 1))
    found = joint.cell_sums(*values, points, width, 3.0, *grid)
    expected = plain.cell_sums(*values, points, width, 3.0, *grid)
    np.testing.assert_array_equal(found[0], expected[0])
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-12, atol=1e-12)


@quick
@given(rngs, st.integers(0, 50))
def test_farthest(rng, count):
    points, before = rng.normal(size=(count, 3)), near(rng)
    after = near(rng, 1e-3) @ before
    found = joint.farthest(points, before, after)
    assert found == pytest.approx(plain.farthest(points, before, after), rel=1e-9)
    assert joint.farthest(points, before, before) == 0


@quick
@given(rngs, st.integers(1, 300), st.integers(6, 128))
def test_fit(rng, size, count):
    points = sphere(rng, size)
    samples = np.concatenate([points[:20], sphere(rng, 20)])
    values = (samples, axes_about(sphere(rng, len(samples))), count, 1e-6)
    found, expected = joint.fit(Tree(points), *values), plain.fit(points, *values)
    for mine, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-6, atol=1e-6)


@quick
@given(rngs, st.integers(2, 300), st.booleans())
def test_distances(rng, size, twice):
    points = np.repeat(sphere(rng, size), 2, axis=0) if twice else sphere(rng, size)
    for rank in {1, 12, size - 1} & set(range(size)):
        found = joint.distances(Tree(points), rank)
        np.testing.assert_allclose(found, plain.distances(points, rank), rtol=1e-12)
    for rank in (0, len(points)):
        with pytest.raises(ValueError, match="rank of 1 to"):
            joint.distances(Tree(points), rank)


@pytest.mark.parametrize("kind", ["one point", "one spot", "a line"])
def test_patches_through_what_makes_no_surface_are_finite(kind):
    count = 1 if kind == "one point" else 40
    points = np.ones((count, 3)) if kind != "a line" else np.outer(np.arange(40.0), [1, 2, 3])
    found = joint.fit(Tree(points), points, axes_about(np.tile([0.0, 0, 1], (count, 1))), 30, 1e-9)
    assert all(np.isfinite(one).all() for one in found)
    if kind != "a line":
        np.testing.assert_array_equal(np.concatenate([one.ravel() for one in found]), 0)


def test_wrong_sizes_are_refused(rng):
    _, one = surface(rng, 10)
    inside, outside = np.arange(3), np.arange(8, 11)
    with pytest.raises(ValueError, match="positions among 10, got 10"):
        joint.gaps(one, np.zeros((3, 3)), outside, True)
    with pytest.raises(ValueError, match="points for 3 patches"):
        joint.gaps(one, np.zeros((2, 3)), inside, True)
    motions = (np.eye(4), np.eye(4))
    with pytest.raises(ValueError, match="positions among 10"):
        joint.rows(one, one, *motions, inside, outside, np.zeros(3), 1.0, True)
    with pytest.raises(ValueError, match="a patch for each of 3"):
        joint.rows(one, one, *motions, inside, inside[:2], np.zeros(3), 1.0, True)
    with pytest.raises(ValueError, match=r"motion \(4, 4\)"):
        joint.contacts(one, one, np.eye(3), 1.0, 1, True, 0.7, True)
    with pytest.raises(ValueError, match="stride of 1 or more"):
        joint.contacts(one, one, np.eye(4), 1.0, 0, True, 0.7, True)
    with pytest.raises(ValueError, match=r"\(M, 6\)"):
        joint.normal_equations(np.zeros((4, 6)), np.zeros(3), np.zeros(4), 1.0, 3.0)
    sums = (np.zeros((4, 6)), np.zeros(4), np.zeros(4))
    with pytest.raises(ValueError, match=r"\(M, 6\)"):
        joint.cell_sums(*sums, np.zeros((3, 3)), 1.0, 3.0, np.zeros(3), 1.0, np.ones(3))
    with pytest.raises(ValueError, match="1 to 128 neighbours"):
        joint.fit(Tree(np.zeros((5, 3))), np.zeros((2, 3)), np.zeros((2, 3, 3)), 129, 0.0)
    with pytest.raises(ValueError, match="axes for each of 2"):
        joint.fit(Tree(np.zeros((5, 3))), np.zeros((2, 3)), np.zeros((3, 3, 3)), 5, 0.0)
    with pytest.raises(ValueError, match="at least one point"):
        joint.fit(Tree(np.zeros((0, 3))), np.zeros((2, 3)), np.zeros((2, 3, 3)), 5, 0.0)
