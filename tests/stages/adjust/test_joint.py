"""Joint refinement: where it ends, what it says of itself, and what it leaves alone."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mvreg
from mvreg import parallel
from mvreg.errors import InputError
from mvreg.evaluation.pose_errors import pose_errors
from mvreg.geometry import se3
from mvreg.stages.adjust.joint import block_matrix, correspondences, solver
from mvreg.stages.adjust.joint import rows as rows_module
from mvreg.stages.adjust.joint.convergence import extrapolated
from mvreg.stages.adjust.joint.correspondences import Contacts, Gate, contacts, touching
from mvreg.stages.adjust.joint.frame import Frame
from mvreg.stages.adjust.joint.normal_equations import MAD, System, spread, summed
from mvreg.stages.adjust.joint.rows import Residuals, Rows, rows
from mvreg.stages.adjust.joint.stage import JointRefinement
from mvreg.stages.adjust.joint.surface import surfaces
from mvreg.stages.adjust.joint.systematic import NONE
from mvreg.stages.adjust.joint.weighting import Pooled, by_noise, plainly
from mvreg.testing import blob_scans, pipeline
from mvreg.testing.compare import digest
from mvreg.testing.results import misplacement
from mvreg.testing.scans import degenerate_points, plane_scans
from mvreg.testing.views import moved_view, plain_view, scaled_pose, scaled_view
from mvreg.types import Result

COUNT = 4


@cache
def views():
    return tuple(pipeline().prepare(blob_scans(COUNT).scans, np.random.default_rng(0)))


def truth(seen=None):
    seen, poses = seen or views(), blob_scans(COUNT).poses
    base = se3.invert(poses[seen[0].name])
    return {v.name: base @ poses[v.name] for v in seen} | {seen[0].name: np.eye(4)}


def spoilt(poses, seen, degrees, resolutions, number=0):
    """Poses turned about the middle of each scan, and shifted; the first stays."""
    rng, found = np.random.default_rng(number), dict(poses)
    for view in seen[1:]:
        axis, way = (x / np.linalg.norm(x) for x in rng.normal(size=(2, 3)))
        turn = se3.exp(np.append(np.deg2rad(degrees) * axis, np.zeros(3)))
        middle = view.points.mean(axis=0)
        shift = middle - turn[:3, :3] @ middle + resolutions * view.scale.resolution * way
        found[view.name] = poses[view.name] @ se3.from_parts(turn[:3, :3], shift)
    return found


def refine(poses, seen=None, stage=None, **parts):
    seen = views() if seen is None else seen
    start = Result(seen[0].name, poses, (), (), **parts)
    return (stage or JointRefinement())(start, list(seen), pipeline())


@pytest.mark.parametrize(("degrees", "resolutions"), [(0, 0), (1, 1), (3, 0), (3, 2)])
def test_it_ends_at_the_truth_wherever_it_starts(degrees, resolutions):
    start = spoilt(truth(), views(), degrees, resolutions)
    found = refine(start)
    assert misplacement(found.poses, truth(), views(), views()[0].name) < 0.02
    if degrees:
        assert misplacement(start, truth(), views(), views()[0].name) > 0.5


def test_all_starts_end_at_one_place():
    ends = [refine(spoilt(truth(), views(), 3, 1, number)).poses for number in range(3)]
    for end in ends[1:]:
        assert misplacement(end, ends[0], views(), views()[0].name) < 0.01


def test_rounds_that_would_only_confirm_are_left_out(monkeypatch):
    rounds, whole = [], solver.Solver.round
    monkeypatch.setattr(
        solver.Solver, "round", lambda self, *args: rounds.append(args) or whole(self, *args)
    )
    start = spoilt(truth(), views(), 2, 1)
    end, few = refine(start).poses, len(rounds)
    monkeypatch.setattr(solver, "SHRINKING", 1.0)
    confirmed = refine(start).poses
    assert few < len(rounds) - few
    assert misplacement(end, confirmed, views(), views()[0].name) < 0.01


def test_threads_do_not_change_a_bit(monkeypatch):
    start, answers = spoilt(truth(), views(), 2, 1), []
    for count in (1, 3):
        monkeypatch.setattr(parallel, "threads", lambda count=count: count)
        answers.append(digest(refine(start)))
    assert answers[0] == answers[1]


def test_few_poses_are_solved_for_as_many_are(monkeypatch):
    few = refine(spoilt(truth(), views(), 2, 1))
    monkeypatch.setattr(block_matrix, "FEW", 0)
    many = refine(spoilt(truth(), views(), 2, 1))
    for name, pose in few.poses.items():
        np.testing.assert_allclose(many.poses[name], pose, atol=1e-9 * np.abs(pose).max())
    for name, covariance in few.covariances.items():
        np.testing.assert_allclose(
            many.covariances[name], covariance, atol=1e-7 * np.abs(covariance).max()
        )


@pytest.mark.parametrize("few", [0, 4])
def test_blocks_add_up_where_they_fall(monkeypatch, few, rng):
    monkeypatch.setattr(block_matrix, "FEW", few)
    blocks, where = rng.normal(size=(9, 2, 6)), rng.integers(3, size=(9, 2))
    expected = np.zeros((6, 18))
    for block, (row, column) in zip(blocks, where, strict=True):
        expected[2 * row : 2 * row + 2, 6 * column : 6 * column + 6] += block
    found = block_matrix.of_blocks(blocks, where[:, 0], where[:, 1], (3, 3))
    assert isinstance(found, np.ndarray) == bool(few)
    np.testing.assert_allclose(block_matrix.dense(found), expected, rtol=1e-12)
    square = found.T @ found
    right = rng.normal(size=(18, 2))
    damped = expected.T @ expected
    damped += 1e-3 * damped.diagonal().mean() * np.eye(18)
    solved = block_matrix.solver(square, 1e-3)(right)
    np.testing.assert_allclose(damped @ solved, right, atol=1e-9)


def test_the_reference_is_held_whichever_it_is():
    seen = (views()[2], views()[0], views()[1], views()[3])
    found = refine(spoilt(truth(seen), seen, 1, 1), seen)
    np.testing.assert_array_equal(found.poses[seen[0].name], np.eye(4))
    np.testing.assert_array_equal(found.covariances[seen[0].name], np.zeros((6, 6)))
    assert misplacement(found.poses, truth(seen), seen, seen[0].name) < 0.02


def test_a_scan_that_touches_nothing_stays_and_has_no_covariance():
    poses, far = spoilt(truth(), views(), 1, 1), views()[3].name
    poses[far] = se3.from_parts(np.eye(3), np.full(3, 1e4))
    found = refine(poses)
    np.testing.assert_array_equal(found.poses[far], poses[far])
    assert set(found.covariances) == set(poses) - {far}
    assert far not in {name for link in found.links for name in (link.source, link.target)}
    placed = views()[:3]
    known = {view.name: found.poses[view.name] for view in placed}
    assert misplacement(known, truth(), placed, placed[0].name) < 0.02


def test_partial_models_are_refined_in_frames_of_their_own():
    right = truth()
    main, other = views()[:2], views()[2:]
    base = se3.invert(right[other[0].name])
    part = {view.name: base @ right[view.name] for view in other} | {other[0].name: np.eye(4)}
    start = spoilt({view.name: right[view.name] for view in main}, main, 1, 1)
    found = refine(start, components=(spoilt(part, other, 1, 1),))
    (end,) = found.components
    np.testing.assert_array_equal(end[other[0].name], np.eye(4))
    assert misplacement(end, part, other, other[0].name) < 0.05
    assert misplacement(found.poses, right, main, main[0].name) < 0.05
    assert set(found.covariances) == {view.name for view in views()}


def test_links_tell_who_lies_on_whom():
    found = refine(truth())
    names = {(link.source, link.target) for link in found.links}
    first, second = views()[:2]
    assert {(first.name, second.name), (second.name, first.name)} <= names
    for link in found.links:
        assert 0 < link.points <= max(len(view.points) for view in views())
        assert 0 < link.rms < 0.1 * first.scale.resolution


def test_the_misfit_of_links_is_a_length():
    start, seen = truth(), [scaled_view(view, 1000.0) for view in views()]
    one = refine(start).links
    other = refine({name: scaled_pose(pose, 1000.0) for name, pose in start.items()}, seen).links
    assert [link.points for link in other] == [link.points for link in one]
    np.testing.assert_allclose([k.rms for k in other], [1000 * k.rms for k in one], rtol=5e-3)


def test_another_unit_changes_covariances_as_units_do():
    start = spoilt(truth(), views(), 1, 1)
    one = refine(start)
    there = [scaled_view(view, 1024.0) for view in views()]
    other = refine({name: scaled_pose(pose, 1024.0) for name, pose in start.items()}, there)
    unit = np.array([1, 1, 1, 1024.0, 1024, 1024])
    for name, covariance in one.covariances.items():
        expected = covariance * np.outer(unit, unit)
        np.testing.assert_allclose(other.covariances[name], expected, rtol=1e-6, atol=1e-18)


def noisy(noise, number):
    """Views of the blob with another draw of noise along the rays (mm)."""
    rng, scans = np.random.default_rng(number), []
    for scan in blob_scans(COUNT, noise=0.0).scans:
        error = noise * rng.normal(size=(len(scan.points), 1)) * scan.view_direction
        scans.append(replace(scan, points=scan.points + error))
    return pipeline().prepare(scans, np.random.default_rng(0))


def test_covariances_say_how_far_estimates_scatter():
    """Twists of 12 draws against what each draw says of itself: within a factor of two."""
    right, errors, told = truth(), [], []
    for number in range(12):
        found = refine(right, noisy(0.3, number))
        for view in views()[1:]:
            twist = se3.log(found.poses[view.name] @ se3.invert(right[view.name]))
            errors.append(twist)
            told.append(found.covariances[view.name])
    scaled = [e @ np.linalg.solve(c, e) / 6 for e, c in zip(errors, told, strict=True)]
    assert 0.25 < np.median(scaled) < 4
    spread = np.sqrt(np.mean(np.square(errors), axis=0))
    expected = np.sqrt(np.mean([np.diag(c) for c in told], axis=0))
    assert (spread < 2 * expected).all() and (expected < 2 * spread).all()


def test_covariances_shrink_with_the_noise():
    sizes = []
    for noise in (0.4, 0.1, 0.025):
        found = refine(truth(), noisy(noise, 0))
        sizes.append(np.sqrt(np.trace(found.covariances[views()[1].name][3:, 3:])))
    assert sizes[0] > 2 * sizes[1] > 4 * sizes[2] * 0.75
    for covariance in found.covariances.values():
        np.testing.assert_allclose(covariance, covariance.T)
        assert np.linalg.eigvalsh(covariance).min() >= 0


def test_planes_do_not_slide():
    scans = plane_scans(3)
    seen = pipeline().prepare(scans.scans, np.random.default_rng(0))
    base = se3.invert(scans.poses[seen[0].name])
    poses = {view.name: base @ scans.poses[view.name] for view in seen} | {seen[0].name: np.eye(4)}
    found = refine(poses, seen)
    assert misplacement(found.poses, poses, seen, seen[0].name) < 1e-6


@pytest.mark.parametrize("name", sorted(degenerate_points()))
def test_poor_scans_do_no_harm(name):
    poor = plain_view("poor", degenerate_points()[name], views()[0].scale)
    seen = [*views(), poor]
    found = refine(spoilt(truth(), views(), 1, 1) | {"poor": np.eye(4)}, seen)
    for covariance in found.covariances.values():
        assert np.isfinite(covariance).all()
    assert misplacement({v.name: found.poses[v.name] for v in views()}, truth(), views(),
                        views()[0].name) < 0.1  # fmt: skip


def test_nothing_in_touch_leaves_the_result_alone():
    poses = {v.name: se3.from_parts(np.eye(3), np.full(3, 1e4 * k)) for k, v in enumerate(views())}
    start = Result(views()[0].name, poses, (), ())
    assert JointRefinement()(start, views(), pipeline()) is start
    assert JointRefinement(max_rounds=0)(replace(start, poses=truth()), views(), pipeline()).poses


def test_the_guard_keeps_poses_that_are_better(monkeypatch):
    """Steps the wrong way are not taken over."""
    step = System.step
    monkeypatch.setattr(System, "step", lambda self: np.full_like(step(self), 0.02))
    start = truth()
    kept = refine(start, stage=JointRefinement(max_rounds=1))
    np.testing.assert_array_equal(kept.poses[views()[1].name], start[views()[1].name])
    lost = refine(start, stage=JointRefinement(max_rounds=1, guarded=False))
    assert misplacement(lost.poses, start, views(), views()[0].name) > 0.5


@pytest.mark.parametrize("wrong", [{"reach": 0}, {"kernel": -1.0}, {"max_rounds": -1}])
def test_wrong_parameters(wrong):
    with pytest.raises(InputError, match=f"adjust.{next(iter(wrong))}: expected"):
        JointRefinement(**wrong)


def test_patches_lie_on_a_paraboloid(rng):
    across = rng.uniform(-1, 1, size=(4000, 2))
    points = np.column_stack([across, 0.2 * across[:, 0] ** 2 - 0.3 * across.prod(axis=1)])
    base = views()[0]
    seen = replace(base, points=points, scan=None, normals=np.tile([0.0, 0, 1], (4000, 1)))
    (surface,) = surfaces([seen])
    asked = np.flatnonzero(surface.whole & (np.abs(across) < 0.5).all(axis=1))[:50]
    x, y = across[asked].T
    normal = np.column_stack([-0.4 * x + 0.3 * y, 0.3 * x, np.ones(50)])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(surface.normals[asked], normal, atol=2e-3)
    heights, normals, aside = surface.gaps(points[asked] + 0.01 * normal, asked, flat=False)
    np.testing.assert_allclose(heights, 0.01, atol=1e-4)
    np.testing.assert_allclose(normals, normal, atol=2e-3)
    assert (aside < 0.01).all()


def test_rows_change_as_their_jacobian_says():
    shapes, motions = surfaces(views()), np.stack([truth()[view.name] for view in views()])
    gate = Gate(2 * views()[0].scale.resolution)
    found = contacts(shapes, motions, touching(shapes, motions, gate.reach), gate)
    frame = Frame.of(shapes, motions)
    before = rows(shapes, motions, found, frame, flat=False)
    unknowns = 1e-6 * np.random.default_rng(0).normal(size=(1, 6))
    motions[1] = frame.motion(unknowns)[0] @ motions[1]
    after = rows(shapes, motions, found, frame, flat=False)
    source, target = np.repeat(found.ways, found.counts, axis=0).T
    sign = (source == 1).astype(float) - (target == 1)
    assert {-1, 0, 1} == set(sign)
    change = after.residuals - before.residuals
    # Slopes of a patch change along it: that is of second order only where gaps are small.
    np.testing.assert_allclose(change, sign * (before.jacobian @ unknowns[0]), atol=4e-8)


@pytest.mark.parametrize("count", [1, 2, 3, 10, 1001])
def test_the_spread_is_that_of_the_median(count, rng):
    residuals = rng.normal(size=count)
    assert spread(residuals) == pytest.approx(MAD * np.median(np.abs(residuals)), rel=1e-15)


def test_some_ways_keep_their_contacts(rng):
    ends = np.array([0, 3, 3, 7, 9])
    found = Contacts(rng.integers(5, size=(4, 2)), ends, *rng.integers(9, size=(2, 9)), np.ones(9))
    some = found.some(np.array([False, True, True, True]))
    np.testing.assert_array_equal(some.ways, found.ways[1:])
    np.testing.assert_array_equal(some.ends, [0, 0, 4, 6])
    np.testing.assert_array_equal(some.samples, found.samples[3:])
    np.testing.assert_array_equal(some.patches, found.patches[3:])
    assert found.some(np.ones(4, bool)) is found


def test_thinned_contacts_stay_with_their_ways(rng):
    ends, order = np.array([0, 3, 3, 8, 9]), np.arange(9)
    found = Contacts(rng.integers(5, size=(4, 2)), ends, order, order, np.ones(9))
    some = found.thinned(5)
    np.testing.assert_array_equal(some.samples, [0, 2, 4, 6, 8])
    np.testing.assert_array_equal(some.ends, [0, 2, 2, 4, 5])
    tile = some.tile(slice(1, 4))
    np.testing.assert_array_equal(tile.ways, found.ways[1:])
    np.testing.assert_array_equal(tile.ends, [0, 0, 2, 3])
    np.testing.assert_array_equal(tile.samples, [4, 6, 8])
    assert found.thinned(9) is found


def test_sums_over_contacts_are_those_over_rows():
    shapes, motions = surfaces(views()), np.stack([truth()[view.name] for view in views()])
    gate = Gate(2 * views()[0].scale.resolution)
    found = contacts(shapes, motions, touching(shapes, motions, gate.reach), gate)
    known, frame = Pooled.of(shapes), Frame.of(shapes, motions)
    trust = by_noise(known, found, 1, NONE)
    apart = rows(shapes, motions, replace(found, weights=trust.weights(found)), frame, flat=False)
    whitened = apart.whitened(np.sqrt(trust.variances(found, apart.aside)))
    expected, patches = System.of(whitened, [1, 2, 3], 3.0), [one.patches for one in shapes]
    sums = found.in_tiles(lambda tile: summed(patches, motions, tile, trust, frame, False, 3.0))
    system = System.assembled(found.ways, sums, [1, 2, 3])
    scale = frame.radius**2  # rows are in lengths
    np.testing.assert_allclose(scale * system.normal, expected.normal, rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(scale * system.gradient, expected.gradient, rtol=1e-9, atol=1e-3)


def test_rows_made_tile_by_tile_are_the_same(monkeypatch):
    shapes, motions = surfaces(views()), np.stack([truth()[view.name] for view in views()])
    gate = Gate(2 * views()[0].scale.resolution)
    found = contacts(shapes, motions, touching(shapes, motions, gate.reach), gate)
    trust, frame = by_noise(Pooled.of(shapes), found, 1, NONE), Frame.of(shapes, motions)
    apart = rows(shapes, motions, replace(found, weights=trust.weights(found)), frame, flat=False)
    whole = apart.whitened(np.sqrt(trust.variances(found, apart.aside)))
    assert isinstance(Residuals.of(shapes, motions, found, trust, frame), Rows)
    monkeypatch.setattr(correspondences, "TILE", len(found.samples) // 40)
    monkeypatch.setattr(rows_module, "KEPT", 0)
    tiled = Residuals.of(shapes, motions, found, trust, frame)
    assert len(found.parts()) > 2
    for name in ("residuals", "unit", "weights"):
        np.testing.assert_array_equal(getattr(tiled, name), getattr(whole, name))
    for name in ("residuals", "jacobian", "points", "aside", "unit", "weights"):
        parts = tiled.in_tiles(lambda tile, name=name: getattr(tile, name))
        np.testing.assert_array_equal(np.concatenate(parts), getattr(whole, name))
        np.testing.assert_array_equal(getattr(tiled.whole(), name), getattr(whole, name))


def test_a_refinement_without_all_rows_at_once_is_the_same(monkeypatch):
    whole = refine(truth())
    monkeypatch.setattr(rows_module, "KEPT", 0)
    tiled = refine(truth())
    for name, pose in whole.poses.items():
        np.testing.assert_array_equal(tiled.poses[name], pose)
        np.testing.assert_array_equal(tiled.covariances[name], whole.covariances[name])
    assert tiled.patterns == whole.patterns and len(tiled.links) == len(whole.links)


def test_what_many_scans_share_counts_once():
    """Three scans of one surface: a way stands for a third of it, and both ways for two thirds."""
    shapes = [surfaces([moved_view(views()[0], np.eye(4))])[0]] * 3
    motions, reach = np.stack([np.eye(4)] * 3), views()[0].scale.resolution
    found = contacts(shapes, motions, [(0, 1), (0, 2), (1, 2)], Gate(reach))
    weights = plainly(Pooled.of(shapes), found, 1).weights(found)
    asked = shapes[0].counts * shapes[0].cosines ** 2
    assert found.ways.tolist() == [[0, 1], [1, 0], [0, 2], [2, 0], [1, 2], [2, 1]]
    np.testing.assert_allclose(weights, asked[found.samples] / 3 / 2)


def test_crowded_scans_are_asked_for_every_second_sample(monkeypatch):
    strides, find = [], solver.contacts
    monkeypatch.setattr(
        solver, "contacts", lambda *args: strides.append(args[-1].stride) or find(*args)
    )
    start = spoilt(truth(), views(), 1, 1)
    every = refine(start)
    assert strides[-1] == 1
    monkeypatch.setattr(solver, "CROWDED", 0.5)
    half = refine(start)
    assert strides[-1] == 2
    assert misplacement(half.poses, every.poses, views(), views()[0].name) < 0.02


def test_pairs_are_those_whose_boxes_meet():
    from mvreg.surface.overlap import neighbours

    rng = np.random.default_rng(0)
    seen = [moved_view(views()[0], np.eye(4))] * 12
    seen = [replace(view, name=str(k)) for k, view in enumerate(seen)]
    poses = {view.name: se3.random(rng, 150.0) for view in seen}
    # A box is that of the patches' origins; with a scan of its own points they are the points.
    shapes = surfaces(seen)
    seen = [replace(v, points=s.points) for v, s in zip(seen, shapes, strict=True)]
    motions = np.stack([poses[view.name] for view in seen])
    expected = {(i, j) for i, j in neighbours(seen, poses, 5.0) if i < j}
    assert 0 < len(expected) < 66
    assert set(touching(shapes, motions, 5.0)) == expected


def test_bunny_from_the_truth_and_from_three_degrees_off(data_root, monkeypatch):
    monkeypatch.setenv("MVREG_DATA", str(data_root))
    scanset = mvreg.dataset("bunny")
    pipe = mvreg.load_method("fcpma").pipeline
    seen = pipe.prepare(scanset.scans, np.random.default_rng(0))
    base = se3.invert(scanset.poses[seen[0].name])
    right = {v.name: base @ scanset.poses[v.name] for v in seen} | {seen[0].name: np.eye(4)}
    ends = [refine(start, seen) for start in (right, spoilt(right, seen, 3, 2))]
    assert misplacement(ends[1].poses, ends[0].poses, seen, seen[0].name) < 0.05
    for end in ends:
        errors = pose_errors(end.poses, right, seen[0].name).mean
        assert errors.rotation < 0.0048
        assert errors.translation < 0.30


def test_steps_that_halve_are_followed_to_their_end():
    whole = np.array([[0.0] * 6, [0.02, 0, 0.01, 1.0, 0, 0], [0, 0, 0, 0, 2.0, 0]])
    steps = [whole / 2, whole / 4]  # a half, a quarter, and so on
    motions = np.stack([se3.exp(0.75 * one) for one in whole])
    found = extrapolated(steps, motions, [1, 2])
    np.testing.assert_allclose(found, [se3.exp(one) for one in whole], atol=1e-9)
    for others in ([whole, -whole / 2], [whole, whole / 10], [whole], [0 * whole, 0 * whole]):
        np.testing.assert_array_equal(extrapolated(others, motions, [1, 2]), motions)
