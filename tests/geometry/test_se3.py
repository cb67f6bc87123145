import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mvreg.geometry import se3

quick = settings(max_examples=40, deadline=None)

rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)
shifts = st.sampled_from([0.0, 1e-3, 1.0, 1e4])


def close(first, second, size=1.0):
    np.testing.assert_allclose(first, second, atol=1e-10 * max(size, 1.0))


def rigid(transform):
    rotation = transform[..., :3, :3]
    close(rotation @ np.swapaxes(rotation, -1, -2), np.broadcast_to(np.eye(3), rotation.shape))
    close(np.linalg.det(rotation), 1)
    np.testing.assert_array_equal(transform[..., 3, :][..., :3], 0)
    np.testing.assert_array_equal(transform[..., 3, 3], 1)


@quick
@given(rngs, shifts)
def test_motions_form_a_group(rng, shift):
    a, b, c = (se3.random(rng, shift) for _ in range(3))
    points = rng.normal(size=(7, 3))
    size = 10 * shift + 10
    close(se3.apply(a @ b, points), se3.apply(a, se3.apply(b, points)), size)
    close((a @ b) @ c, a @ (b @ c), size)
    close(a @ se3.invert(a), np.eye(4), size)
    close(se3.invert(se3.invert(a)), a, size)
    close(se3.invert(a @ b), se3.invert(b) @ se3.invert(a), size)
    close(se3.apply(np.eye(4), points), points)
    rigid(a @ b)


@quick
@given(rngs)
def test_motions_keep_distances_and_hands(rng):
    points = rng.normal(size=(4, 3))
    moved = se3.apply(se3.random(rng, 5.0), points)
    for cloud in (points, moved):
        assert cloud.shape == (4, 3)
    sides = [np.linalg.norm(x[:, None] - x[None], axis=2) for x in (points, moved)]
    close(*sides)
    volumes = [np.linalg.det(x[1:] - x[0]) for x in (points, moved)]
    close(*volumes, size=10)


@quick
@given(rngs, st.integers(1, 5))
def test_a_batch_is_many(rng, count):
    batch = np.stack([se3.random(rng, 2.0) for _ in range(count)])
    rigid(se3.invert(batch))
    for one, inverse in zip(batch, se3.invert(batch), strict=True):
        np.testing.assert_array_equal(inverse, se3.invert(one))
    parts = se3.from_parts(batch[:, :3, :3], batch[:, :3, 3])
    np.testing.assert_array_equal(parts, batch)


@quick
@given(rngs, shifts, st.integers(3, 30))
def test_a_fit_to_exact_points_is_exact(rng, shift, count):
    truth = se3.random(rng, shift)
    source = rng.normal(size=(count, 3))
    found = se3.fit(source, se3.apply(truth, source))
    rigid(found)
    close(se3.apply(found, source), se3.apply(truth, source), 1e3 * (shift + 1))
    weights = rng.uniform(0.1, 1, size=count)
    weighted = se3.fit(source, se3.apply(truth, source), weights)
    close(se3.apply(weighted, source), se3.apply(truth, source), 1e3 * (shift + 1))


@quick
@given(rngs)
def test_a_fit_is_the_best_there_is(rng):
    source, target = rng.normal(size=(2, 9, 3))
    weights = rng.uniform(size=9)

    def cost(transform):
        return (weights * ((se3.apply(transform, source) - target) ** 2).sum(axis=1)).sum()

    best = se3.fit(source, target, weights)
    rigid(best)
    for _ in range(20):
        small = np.append(rng.normal(size=3) * 10 ** rng.uniform(-4, 0), 1)
        nudge = se3.from_parts(se3.rotation_from_quaternion(small), rng.normal(size=3) * 0.1)
        assert cost(best) <= cost(best @ nudge) + 1e-12


@quick
@given(rngs)
def test_a_fit_agrees_with_scipy(rng):
    source, target = rng.normal(size=(2, 12, 3))
    weights = rng.uniform(0.1, 1, size=12)
    share = weights / weights.sum()
    centred = [x - share @ x for x in (target, source)]
    expected, _ = Rotation.align_vectors(*centred, weights)
    close(se3.fit(source, target, weights)[:3, :3], expected.as_matrix())


@quick
@given(rngs, st.integers(1, 4))
def test_fits_come_in_batches(rng, count):
    source, target = rng.normal(size=(2, count, 8, 3))
    weights = rng.uniform(0.1, 1, size=(count, 8))
    for index, (plain, weighted) in enumerate(
        zip(se3.fit(source, target), se3.fit(source, target, weights), strict=True)
    ):
        close(plain, se3.fit(source[index], target[index]))
        close(weighted, se3.fit(source[index], target[index], weights[index]))


@quick
@given(rngs)
def test_weights_count_points(rng):
    source, target = rng.normal(size=(2, 6, 3))
    times = np.array([1, 2, 0, 3, 1, 1])
    repeated = se3.fit(np.repeat(source, times, axis=0), np.repeat(target, times, axis=0))
    close(se3.fit(source, target, times.astype(float)), repeated)
    close(se3.fit(source, target, np.full(6, 7.0)), se3.fit(source, target))


@pytest.mark.parametrize(
    "source",
    [
        np.zeros((1, 3)),
        np.ones((5, 3)),
        np.outer(np.arange(5.0), [1.0, 2.0, -1.0]),
        np.concatenate([np.random.default_rng(0).normal(size=(9, 2)), np.zeros((9, 1))], axis=1),
    ],
    ids=["point", "duplicates", "line", "plane"],
)
def test_a_fit_to_flat_points_is_a_rotation_too(source, rng):
    truth = se3.random(rng, 3.0)
    target = se3.apply(truth, source)
    found = se3.fit(source, target)
    rigid(found)
    close(se3.apply(found, source), target, 100)


def test_a_mirror_image_is_not_answered_with_a_mirror(rng):
    source = rng.normal(size=(20, 3))
    rigid(se3.fit(source, source * [1, 1, -1]))


@quick
@given(rngs, st.floats(0, 1e-3))
def test_projection_takes_the_drift_out(rng, drift):
    truth = se3.random(rng, 2.0)
    spoilt = truth.copy()
    spoilt[:3, :3] += drift * rng.normal(size=(3, 3))
    found = se3.project(spoilt)
    rigid(found)
    np.testing.assert_allclose(found, truth, atol=10 * drift + 1e-12)
    close(se3.project(found), found)
    difference = np.linalg.norm(spoilt - found)
    for _ in range(5):
        assert difference <= np.linalg.norm(spoilt - found @ se3.random(rng)) + 1e-12


def test_the_projection_of_a_mirror_is_no_mirror(rng):
    turn = se3.random(rng, 2.0)
    spoilt = turn @ np.diag([1.0, 0.9, -0.1, 1.0])
    np.testing.assert_allclose(se3.project(spoilt), turn, atol=1e-12)


@quick
@given(rngs, st.sampled_from([0.0, 1e-9, 1e-4, 0.3, 2.0, 3.1]))
def test_the_angle_between_rotations(rng, angle):
    axis = rng.normal(size=3)
    axis *= np.sin(angle / 2) / np.linalg.norm(axis)
    turn = se3.rotation_from_quaternion(np.append(axis, np.cos(angle / 2)))
    first = se3.random(rng, 5.0)
    second = first @ se3.from_parts(turn, rng.normal(size=3))
    np.testing.assert_allclose(se3.rotation_angle(first, second), angle, rtol=1e-6, atol=1e-14)
    np.testing.assert_allclose(
        se3.rotation_angle(np.stack([first, second]), second), [angle, 0], rtol=1e-6, atol=1e-14
    )


def test_half_a_turn_is_the_largest_angle():
    half = se3.from_parts(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    np.testing.assert_allclose(se3.rotation_angle(half, np.eye(4)), np.pi)


@quick
@given(rngs, st.floats(1e-3, 1e3))
def test_quaternions_mean_what_scipy_means(rng, length):
    quaternion = rng.normal(size=4)
    quaternion *= length / np.linalg.norm(quaternion)
    found = se3.rotation_from_quaternion(quaternion)
    close(found, Rotation.from_quat(quaternion).as_matrix())
    close(found, se3.rotation_from_quaternion(-quaternion))


def test_random_motions_are_uniform_and_repeat():
    one, two = (se3.random(np.random.default_rng(5), 2.0) for _ in range(2))
    np.testing.assert_array_equal(one, two)
    rng = np.random.default_rng(0)
    many = np.stack([se3.random(rng, 2.0) for _ in range(2000)])
    rigid(many)
    assert np.abs(many[:, :3, :3].mean(axis=0)).max() < 0.05, "no rotation is preferred"
    assert 1.9 < np.abs(many[:, :3, 3]).max() <= 2.0
    assert np.abs(many[:, :3, 3].mean(axis=0)).max() < 0.1
    np.testing.assert_array_equal(se3.random(rng)[:3, 3], 0)
    # The angles of uniform rotations have the density (1 - cos a) / pi: the mean is pi/2 + 2/pi.
    angles = se3.rotation_angle(many, np.eye(4))
    assert abs(angles.mean() - (np.pi / 2 + 2 / np.pi)) < 0.05


@quick
@given(
    rngs, st.sampled_from([0.0, 1e-12, 1e-6, 9.9e-3, 1.01e-2, 0.3, 2.0, 3.1, np.pi - 1e-9, np.pi])
)
def test_log_undoes_exp_and_exp_undoes_log(rng, angle):
    axis = rng.normal(size=3)
    twist = np.concatenate([angle * axis / np.linalg.norm(axis), rng.normal(size=3)])
    motion = se3.exp(twist)
    rigid(motion)
    close(se3.exp(se3.log(motion)), motion)
    np.testing.assert_allclose(np.linalg.norm(se3.log(motion)[:3]), angle, atol=1e-10)
    if angle < np.pi - 1e-8:  # at half a turn the axis has two directions
        close(se3.log(motion), twist, 10)


@quick
@given(rngs, st.sampled_from([1e-9, 1e-3, 1e-2, 0.5, 3.0]))
def test_exp_is_the_matrix_exponential(rng, angle):
    from scipy.linalg import expm

    axis = rng.normal(size=3)
    twist = np.concatenate([angle * axis / np.linalg.norm(axis), rng.normal(size=3)])
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3] = se3.skew(twist[:3]), twist[3:]
    close(se3.exp(twist), expm(matrix))


@quick
@given(rngs)
def test_rotation_vectors_agree_with_scipy(rng):
    rotations = Rotation.random(7, random_state=int(rng.integers(2**31)))
    close(se3.rotation_vector(rotations.as_matrix()), rotations.as_rotvec())
    first, second = rng.normal(size=(2, 3))
    close(se3.skew(first) @ second, np.cross(first, second))


def test_tiny_motions_lose_no_digits():
    twist = np.array([1e-13, -2e-13, 3e-13, 1e-13, 0.0, 2e-13])
    np.testing.assert_allclose(se3.log(se3.exp(twist))[:3], twist[:3], rtol=1e-12)
    np.testing.assert_allclose(se3.log(se3.exp(1e9 * twist)), 1e9 * twist, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("half", [[1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
def test_half_a_turn_has_a_logarithm(half):
    turn = se3.from_parts(np.diag(np.array(half, float)), np.array([1.0, 2.0, 3.0]))
    close(se3.exp(se3.log(turn)), turn)
    np.testing.assert_allclose(np.linalg.norm(se3.log(turn)[:3]), np.pi)


def test_exp_and_log_come_in_batches(rng):
    twists = rng.normal(size=(2, 3, 6))
    twists[0, 0] = 0
    motions = se3.exp(twists)
    assert motions.shape == (2, 3, 4, 4)
    for index in np.ndindex(2, 3):
        np.testing.assert_array_equal(motions[index], se3.exp(twists[index]))
        np.testing.assert_array_equal(se3.log(motions)[index], se3.log(motions[index]))
    assert se3.log(np.empty((0, 4, 4))).shape == (0, 6)
