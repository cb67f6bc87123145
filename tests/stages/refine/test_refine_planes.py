from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.kernels import trimmed_pairs
from mvreg.screening import FINE_STEP
from mvreg.stages.refine.plane_base import smallest_step
from mvreg.stages.refine.planes import GeneralizedICP, PointToPlane, SymmetricICP
from mvreg.stages.refine.trimmed import Trim, TrimmedICP
from mvreg.testing import blob_views, overlap, plane_scans
from mvreg.testing.compare import apart
from mvreg.testing.refine import nudge
from mvreg.testing.scans import blob_scans
from mvreg.testing.views import UNITS, pipeline, plain_view, scaled_pose, scaled_view

STAGES = [PointToPlane(), SymmetricICP(), GeneralizedICP()]
stages = pytest.mark.parametrize("stage", STAGES, ids=lambda stage: type(stage).__name__)


def neighbours():
    """Pairs of views 40 degrees apart, and ``T_target_source``, exact."""
    views, poses = blob_views(4), blob_scans(4).poses
    for source, target in pairwise(views):
        yield source, target, se3.invert(poses[target.name]) @ poses[source.name]


def some_normals(rng, size):
    normals = rng.normal(size=(size, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def errors(stage, degrees, resolutions):
    """How far points are from where they belong, in resolutions."""
    found = [
        (stage(source, target, truth @ nudge(source, degrees, resolutions)), truth, source)
        for source, target, truth in neighbours()
    ]
    return [apart(f.T_target_source, truth, s.points) / s.resolution for f, truth, s in found]


@stages
def test_it_is_more_accurate_than_tricp_in_fewer_iterations(stage):
    """Two scans have no point in common: TrICP's error is their sampling, planes take it out."""
    assert np.mean(errors(stage, 4.0, 1.0)) < np.mean(errors(TrimmedICP(), 4.0, 1.0)) / 3
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, 4.0, 1.0)
    few, many = (s(pair.source, pair.target, begin) for s in (stage, TrimmedICP()))
    assert few.converged
    assert few.iterations < many.iterations / 3


@stages
def test_it_converges_from_afar(stage):
    assert max(errors(stage, 25.0, 4.0)) < 0.5


@stages
@pytest.mark.parametrize("start", [(0.0, 0.0), (3.0, 1.0), (40.0, 8.0), (170.0, 30.0)])
def test_it_never_ends_worse_than_it_was(stage, start):
    """New pairs may have larger residuals: the best pose seen counts, with its own record."""
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, *start)
    runs = [
        replace(stage, max_iterations=n)(pair.source, pair.target, begin) for n in (0, 1, 2, 4, 30)
    ]
    objectives = [run.objective for run in runs]
    assert objectives == sorted(objectives, reverse=True)
    np.testing.assert_array_equal(runs[0].T_target_source, begin)
    assert [run.iterations for run in runs[:3]] == [0, 1, 2]
    again = replace(stage, max_iterations=0)(pair.source, pair.target, runs[-1].T_target_source)
    assert again.objective == pytest.approx(runs[-1].objective)
    np.testing.assert_array_equal(again.pairs, runs[-1].pairs)


@stages
def test_it_trims_as_tricp_does(stage):
    pair = overlap()
    found = replace(stage, min_overlap=0.2, exponent=1.0)(
        pair.source, pair.target, pair.T_target_source
    )
    moved = se3.apply(found.T_target_source, pair.source.points)
    pairs = Trim(*trimmed_pairs.trimmed(pair.target.tree, moved, np.inf, 0.2, 2.0))
    np.testing.assert_array_equal(found.pairs[:, 0], pairs.chosen)
    np.testing.assert_array_equal(found.pairs[:, 1], pairs.targets)


def test_the_objective_is_psi_of_distances_to_planes():
    pair = overlap()
    found = PointToPlane()(pair.source, pair.target, pair.T_target_source)
    moved = se3.apply(found.T_target_source, pair.source.points)
    i, j = found.pairs.T
    heights = ((moved[i] - pair.target.points[j]) * pair.target.normals[j]).sum(axis=1)
    assert found.objective == pytest.approx((heights**2).mean() / found.overlap**3)
    assert found.objective < found.trimmed_mse / found.overlap**3


@stages
def test_the_right_pose_has_the_lowest_objective(stage):
    """So that candidates can be compared, on a few points, as `refine_best` does."""
    rng = np.random.default_rng(4)
    for source, target, truth in neighbours():
        few = replace(
            source, points=source.points[::FINE_STEP], normals=source.normals[::FINE_STEP]
        )
        right = stage(few, target, truth @ nudge(source, 5.0, 1.0))
        assert apart(right.T_target_source, truth, source.points) < 2 * source.resolution
        for _ in range(5):
            wrong = stage(few, target, truth @ nudge(source, rng.uniform(60, 180), 10.0))
            if apart(wrong.T_target_source, truth, source.points) > 3 * source.resolution:
                assert wrong.objective > right.objective


@stages
def test_signs_of_normals_may_be_unknown(stage):
    """Any of them may be turned round, on either side: bit for bit the same answer."""
    rng, pair = np.random.default_rng(1), overlap()
    begin = pair.T_target_source @ nudge(pair.source, 4.0, 1.0)

    def unsigned(view):
        signs = rng.choice([-1.0, 1.0], size=(len(view.points), 1))
        features = replace(view.features, oriented=False)
        return replace(view, normals=signs * view.normals, features=features)

    signed = stage(pair.source, pair.target, begin)
    found = stage(unsigned(pair.source), unsigned(pair.target), begin)
    np.testing.assert_array_equal(found.T_target_source, signed.T_target_source)
    assert found.objective == signed.objective


@stages
def test_the_objective_has_the_unit_of_a_squared_length(stage):
    pair = overlap()
    begin = pair.T_target_source @ nudge(pair.source, 4.0, 1.0)
    old = stage(pair.source, pair.target, begin)
    for unit in UNITS:
        views = scaled_view(pair.source, unit), scaled_view(pair.target, unit)
        new = stage(*views, scaled_pose(begin, unit))
        assert new.objective == pytest.approx(old.objective * unit**2)
        assert new.iterations == old.iterations


@stages
def test_a_plane_is_met_without_sliding(stage):
    """Nothing fixes the pose within a plane: the step is the smallest that meets it.

    Plane to plane has a weak hold along the plane, too, and may slide onto the points next to it.
    """
    axis = np.arange(-20.0, 21.0, 2.0)
    grid = np.stack(np.meshgrid(axis, axis, [0.0]), axis=-1).reshape(-1, 3)
    source, target = (plain_view(name, grid, overlap().source.scale) for name in "pq")
    lifted = se3.from_parts(np.eye(3), np.array([0.3, -0.2, 1.5]))
    found = stage(source, target, lifted).T_target_source
    np.testing.assert_allclose(found[:3, :3], np.eye(3), atol=1e-9)
    assert abs(found[2, 3]) < 1e-3
    slid = np.linalg.norm(found[:2, 3] - [0.3, -0.2])
    assert slid <= (np.hypot(0.3, 0.2) + 1e-9 if isinstance(stage, GeneralizedICP) else 1e-9)


def test_planes_end_in_finite_poses():
    views = pipeline().prepare(plane_scans().scans, np.random.default_rng(0))
    for stage in STAGES:
        found = stage(*views, np.eye(4))
        assert np.isfinite(found.T_target_source).all()


def test_a_step_solves_the_small_angle_equations():
    """Undamped, by NumPy's own least squares; damping changes a well-held step by a thousandth."""
    rng = np.random.default_rng(2)
    points, gaps = rng.normal(size=(200, 3)), 1e-2 * rng.normal(size=(200, 3))
    points -= points.mean(axis=0)
    normals = some_normals(rng, 200)
    found = smallest_step(points, gaps, normals[:, None], longest=1.0)
    rows = np.hstack([np.cross(points, normals), normals])
    wanted = np.linalg.lstsq(rows, -(gaps * normals).sum(axis=1))[0]
    np.testing.assert_allclose(found, wanted, atol=3e-3 * np.abs(wanted).max())
    short = smallest_step(points, gaps, normals[:, None], longest=1e-5)
    moves = np.cross(short[:3], points) + short[3:]
    assert np.sqrt((moves**2).sum(axis=1).mean()) <= 1e-5
    np.testing.assert_array_equal(smallest_step(points, gaps, np.zeros((200, 1, 3)), 1.0), 0)


def test_noise_does_not_make_a_plane_slide():
    """Noisy normals seem to hold the plane along itself: undamped, it would go a long way."""
    rng = np.random.default_rng(6)
    points = np.append(rng.uniform(-10, 10, size=(400, 2)), np.zeros((400, 1)), axis=1)
    points -= points.mean(axis=0)
    normals = np.array([0.0, 0.0, 1.0]) + 1e-3 * rng.normal(size=(400, 3))
    gaps = (1.0 + 0.1 * rng.normal(size=(400, 1))) * [0, 0, 1]
    found = smallest_step(points, gaps, normals[:, None], longest=10.0)
    assert found[5] == pytest.approx(-1.0, abs=0.05)
    rows = np.hstack([np.cross(points, normals), normals])
    undamped = np.linalg.lstsq(rows, -(gaps * normals).sum(axis=1))[0]
    assert np.linalg.norm(undamped[3:5]) > 0.5
    assert np.linalg.norm(found[3:5]) < 0.1


def test_symmetric_residuals_vanish_on_a_sphere():
    """Points of one sphere, wherever they are: the tangent planes' distances do not vanish."""
    rng = np.random.default_rng(3)
    first, second = some_normals(rng, 50), some_normals(rng, 50)
    gaps = (first - second)[:, :, None]
    symmetric = SymmetricICP().directions(first, second) @ gaps
    same_side = (first * second).sum(axis=1) > 0
    np.testing.assert_allclose(symmetric[same_side], 0, atol=1e-12)
    plane = PointToPlane().directions(first, second) @ gaps
    assert np.abs(plane).mean() > 0.1


def test_plane_to_plane_weighs_a_gap_by_its_direction():
    stage = GeneralizedICP(epsilon=0.01)
    up, right = np.array([[0.0, 0, 1]]), np.array([[1.0, 0, 0]])

    def squared(first, second, gap):
        return float(((stage.directions(first, second) @ gap.T) ** 2).sum())

    assert squared(up, -up, up) == pytest.approx(1.0)
    assert squared(up, up, right) == pytest.approx(0.01)
    assert squared(up, right, up) == pytest.approx(0.02 / 1.01), "discs at an angle hardly count"
    with pytest.raises(InputError, match=r"refine\.epsilon: expected a share in \(0, 1\], got 0"):
        GeneralizedICP(epsilon=0.0)
