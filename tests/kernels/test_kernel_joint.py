"""The kernels of the joint refinement against their reference."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.geometry import se3
from mvreg.kernels import contacts, fit, normal_equations, patches, residuals
from mvreg.kernels.tree import Tree
from mvreg.stages.adjust.joint.patches import axes_about
from mvreg.testing.reference import fit as plain_fit
from mvreg.testing.reference import joint as plain

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
    usable = whole | (rng.random(count) < 0.5)
    reach = rng.uniform(0.05, 0.4, size=count)
    axes[:, :2] += rng.uniform(-1, 1, size=(count, 2, 1)) * axes[:, 2:]  # along rays
    means, wide = points + 0.02 * rng.normal(size=(count, 3)), rng.normal(size=(count, 3, 3))
    seconds = 1e-3 * wide @ np.swapaxes(wide, 1, 2)
    parts = points, axes, slopes, bends, normals, reach, whole, usable, means, seconds
    return plain.Patches(*parts), patches.Patches(Tree(points), *parts)


def near(rng, turn=0.3):
    """A small motion."""
    return se3.exp(turn * rng.normal(size=6))


@quick
@given(rngs, st.integers(0, 50), flats)
def test_gaps(rng, count, flat):
    one, compiled = surface(rng, 30)
    which = rng.integers(0, 30, size=count)
    points = one.points[which] + 0.1 * rng.normal(size=(count, 3))
    found = patches.gaps(compiled, points, which, flat)
    for mine, other in zip(found, plain.gaps(one, points, which, flat), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-12)


def test_patches_tell_what_they_were_made_of(rng):
    one, compiled = surface(rng, 30)
    for mine, theirs in zip(compiled.arrays(), vars(one).values(), strict=True):
        np.testing.assert_array_equal(mine, theirs)


#: Ordered pairs of three surfaces; one twice, and one of a surface with itself.
WAYS = np.array([[0, 1], [2, 0], [1, 2], [0, 1], [1, 1]])


def surfaces(rng, *counts):
    """Several of them, for the reference and for the kernels."""
    made = [surface(rng, count) for count in counts]
    return [one for one, _ in made], [compiled for _, compiled in made]


def parts(rng, count, size):
    """Where each of so many ways begins among `size` rows, and the last one ends."""
    return np.array([0, *np.sort(rng.integers(0, size + 1, size=count - 1)), size])


@quick
@given(
    rngs, st.integers(0, 200), st.sampled_from([0.01, 0.2, 1e200, np.inf]), st.integers(1, 9),
    flats,
)  # fmt: skip
def test_contacts(rng, count, reach, stride, flat):
    ones, compiled = surfaces(rng, count, 200, 40)
    motions = np.stack([near(rng, rng.choice([0.01, 0.3, 3.0])) for _ in ones])
    options = (motions, WAYS, reach, stride, flat, 0.7, rng.random(3) < 0.7)
    found = contacts.contacts(compiled, *options)
    for mine, expected in zip(found, plain.contacts(ones, *options), strict=True):
        np.testing.assert_array_equal(mine, expected)


def one_way(source, target, motion, flat):
    """The samples of a surface that lie on another, at 0.3 apart at most."""
    motions = np.stack([motion, np.eye(4)])
    options = (0.3, 1, flat, 0.7, np.array([True, True]))
    return contacts.contacts([source, target], motions, np.array([[0, 1]]), *options)[1]


def test_contacts_are_found_at_all(rng):
    (_, source), (_, target) = surface(rng, 2000), surface(rng, 2000)
    assert 500 < len(one_way(source, target, np.eye(4), True)) < 1700
    assert 300 < len(one_way(source, target, np.eye(4), False)) < 1700
    turned = se3.exp(np.array([np.pi, 0, 0, 0, 0, 0]))
    assert len(one_way(source, target, turned, True)) > 500
    far = se3.from_parts(np.eye(3), np.array([5.0, 0, 0]))
    assert not len(one_way(source, target, far, True))


def test_nothing_lies_on_a_surface_without_patches(rng):
    (_, source), (_, none) = surface(rng, 20), surface(rng, 0)
    motions, ways, signs = np.stack([np.eye(4)] * 2), np.array([[0, 1], [1, 0]]), np.ones(2, bool)
    found = contacts.contacts([source, none], motions, ways, 9.0, 1, True, 0.7, signs)
    assert [one.shape for one in found] == [(3,), (0,), (0,)]
    nowhere = contacts.contacts([source, none], motions, ways[:0], 9.0, 1, True, 0.7, signs)
    assert [one.shape for one in nowhere] == [(1,), (0,), (0,)]


def filled(kernel, shapes, count, options):
    """What a kernel puts into rows."""
    made = (np.full(count, np.nan), np.full((count, 6), np.nan), np.full((count, 3), np.nan),
            np.full(count, np.nan))  # fmt: skip
    kernel.rows(shapes, *options, *made)
    return made


@quick
@given(rngs, st.integers(0, 60), flats)
def test_rows(rng, count, flat):
    sizes = np.array([40, 50, 30])
    ones, compiled = surfaces(rng, *sizes)
    ends, motions = parts(rng, len(WAYS), count), np.stack([near(rng) for _ in ones])
    many = np.repeat(sizes[WAYS], np.diff(ends), axis=0)
    where = (rng.integers(0, many[:, 0]), rng.integers(0, many[:, 1]))
    point = (rng.normal(size=3), 1.7, flat)
    options = (motions, WAYS, ends, *where, *point)
    expected = filled(plain, ones, count, options)
    for mine, other in zip(filled(residuals, compiled, count, options), expected, strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-11)
    some = filled(residuals, compiled, count, (motions, WAYS[1:3], ends[1:4], *where, *point))
    for mine, other in zip(some, expected, strict=True):
        np.testing.assert_allclose(mine[ends[1] : ends[3]], other[ends[1] : ends[3]], atol=1e-11)
        assert np.isnan(mine[: ends[1]]).all() and np.isnan(mine[ends[3] :]).all()


@quick
@given(rngs, st.integers(0, 200), st.sampled_from([1e-3, 1.0, 1e9]))
def test_normal_equations(rng, count, width):
    values = (rng.normal(size=(count, 6)), rng.normal(size=count), rng.random(count),
              parts(rng, 4, count), width)  # fmt: skip
    found, expected = normal_equations.normal_equations(*values), plain.normal_equations(*values)
    np.testing.assert_allclose(found[0], expected[0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(found[0], np.swapaxes(found[0], 1, 2))


@quick
@given(rngs, st.integers(0, 200), st.sampled_from([1e-3, 1.0, 1e9]), st.sampled_from([1, 9]))
def test_group_sums(rng, count, width, groups):
    values = (rng.normal(size=(count, 6)), rng.normal(size=count), rng.random(count),
              rng.integers(-2, groups, size=count), parts(rng, 3, count), width)  # fmt: skip
    found, expected = normal_equations.group_sums(*values), plain.group_sums(*values)
    np.testing.assert_array_equal(found[0], expected[0])
    np.testing.assert_array_equal(found[1], expected[1])
    np.testing.assert_allclose(found[2], expected[2], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found[3], expected[3], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(found[2], np.swapaxes(found[2], 1, 2))


@quick
@given(rngs, st.integers(0, 50))
def test_farthest(rng, count):
    points, before = rng.normal(size=(count, 3)), near(rng)
    after = near(rng, 1e-3) @ before
    found = residuals.farthest(points, before, after)
    assert found == pytest.approx(plain.farthest(points, before, after), rel=1e-9)
    assert residuals.farthest(points, before, before) == 0


@quick
@given(rngs, st.integers(1, 300), st.integers(6, 128))
def test_fit(rng, size, count):
    points = sphere(rng, size)
    samples = np.concatenate([points[:20], sphere(rng, 20)])
    values = (samples, axes_about(sphere(rng, len(samples))), count, 1e-6)
    found, expected = fit.fit(Tree(points), *values), plain_fit.fit(points, *values)
    for mine, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("kind", ["one point", "one spot", "a line"])
def test_patches_through_what_makes_no_surface_are_finite(kind):
    count = 1 if kind == "one point" else 40
    points = np.ones((count, 3)) if kind != "a line" else np.outer(np.arange(40.0), [1, 2, 3])
    found = fit.fit(Tree(points), points, axes_about(np.tile([0.0, 0, 1], (count, 1))), 30, 1e-9)
    assert all(np.isfinite(one).all() for one in found)
    if kind != "a line":
        assert found.counts.sum() == min(count, 30)
        np.testing.assert_array_equal(found.means, 1)
        zeros = found._replace(counts=np.zeros(1), means=np.zeros(1))
        np.testing.assert_array_equal(np.concatenate([one.ravel() for one in zeros]), 0)


def test_wrong_sizes_are_refused(rng):
    _, one = surface(rng, 10)
    inside, outside = np.arange(3), np.arange(8, 11)
    with pytest.raises(ValueError, match="positions among 10, got 10"):
        patches.gaps(one, np.zeros((3, 3)), outside, True)
    with pytest.raises(ValueError, match="points for 3 patches"):
        patches.gaps(one, np.zeros((2, 3)), inside, True)
    with pytest.raises(ValueError, match="1 to 128 neighbours"):
        fit.fit(Tree(np.zeros((5, 3))), np.zeros((2, 3)), np.zeros((2, 3, 3)), 129, 0.0)
    with pytest.raises(ValueError, match="axes for each of 2"):
        fit.fit(Tree(np.zeros((5, 3))), np.zeros((2, 3)), np.zeros((3, 3, 3)), 5, 0.0)
    with pytest.raises(ValueError, match="at least one point"):
        fit.fit(Tree(np.zeros((0, 3))), np.zeros((2, 3)), np.zeros((2, 3, 3)), 5, 0.0)


def test_wrong_ways_are_refused(rng):
    pair, motions = [surface(rng, 10)[1]] * 2, np.stack([np.eye(4)] * 2)
    ways, signs = np.array([[0, 1]]), np.ones(2, bool)

    def find(motions=motions, ways=ways, stride=1, signs=signs):
        contacts.contacts(pair, motions, ways, 1.0, stride, True, 0.7, signs)

    find()
    with pytest.raises(ValueError, match=r"motions: expected shape \(2, 4, 4\)"):
        find(motions[:, :3, :3])
    with pytest.raises(ValueError, match=r"motions: expected shape \(2, 4, 4\), got \(1, 4, 4\)"):
        find(motions[:1])
    with pytest.raises(ValueError, match=r"ways: expected shape \(W, 2\), got \(2,\)"):
        find(ways=np.array([0, 1]))
    with pytest.raises(ValueError, match="positions among 2, got 2"):
        find(ways=np.array([[0, 2]]))
    with pytest.raises(ValueError, match="stride of 1 or more"):
        find(stride=0)
    with pytest.raises(ValueError, match=r"oriented: expected shape \(2\), got \(1,\)"):
        find(signs=signs[:1])


def test_wrong_rows_are_refused(rng):
    pair, motions = [surface(rng, 10)[1]] * 2, np.stack([np.eye(4)] * 2)
    inside, outside, ways = np.arange(3), np.arange(8, 11), np.array([[0, 1]])

    def fill(samples=inside, patches=inside, ends=(0, 3), count=3, point=(0, 0, 0)):
        made = np.empty(count), np.empty((count, 6)), np.empty((count, 3)), np.empty(count)
        residuals.rows(pair, motions, ways, ends, samples, patches, point, 1.0, True, *made)

    fill()
    with pytest.raises(ValueError, match="10 samples and 10 patches, got 10 and 2"):
        fill(outside)
    with pytest.raises(ValueError, match="10 samples and 10 patches, got 2 and 10"):
        fill(patches=outside)
    with pytest.raises(ValueError, match="expected 3 samples, patches and rows, got 3, 2, 3 and 3"):
        fill(patches=inside[:2])
    with pytest.raises(ValueError, match="expected 4 samples"):
        fill(count=4)
    with pytest.raises(ValueError, match=r"centre: expected shape \(3\), got \(2,\)"):
        fill(point=(0, 0))
    for ends in [(0, 4), (-1, 3), (2, 1)]:
        with pytest.raises(ValueError, match="ascend from 0 to 3"):
            fill(ends=ends)
    with pytest.raises(ValueError, match="the ends of 1 ways, got 3 numbers"):
        fill(ends=(0, 1, 3))


def test_wrong_sums_are_refused():
    values, groups = (np.zeros((4, 6)), np.zeros(4), np.zeros(4)), np.zeros(4, dtype=np.intp)

    def add(jacobian=values[0], residuals=values[1], weights=values[2], ends=(0, 4)):
        given = (jacobian, residuals, weights)
        equations = normal_equations.normal_equations(*given, ends, 1.0)
        return equations, normal_equations.group_sums(*given, groups, ends, 1.0)

    equations, sums = add()
    assert equations.normals.shape == (1, 6, 6) and equations.gradients.shape == (1, 6)
    assert sums.normals.shape == (1, 6, 6) and sums.gradients.shape == (1, 6)
    for wrong, said in (
        ({"jacobian": np.zeros((4, 5))}, r"jacobian: expected shape \(M, 6\)"),
        ({"residuals": np.zeros(3)}, r"residuals: expected shape \(4\), got \(3,\)"),
        ({"weights": np.zeros(3)}, r"weights: expected shape \(4\), got \(3,\)"),
        ({"ends": (0, 5)}, "ascend from 0 to 4"),
    ):
        with pytest.raises(ValueError, match=said):
            add(**wrong)
    with pytest.raises(ValueError, match=r"groups: expected shape \(4\), got \(3,\)"):
        normal_equations.group_sums(*values, groups[:3], [0, 4], 1.0)
