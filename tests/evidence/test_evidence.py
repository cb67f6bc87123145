"""The evidence of a pose: what each part of it measures, how it pools, what it cannot tell."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mvreg.evidence.calibration import FEATURES, WEIGHTS, features, probability
from mvreg.evidence.pooled import ViewPair, pool_evidence
from mvreg.evidence.pooling import free_space_violation
from mvreg.evidence.view_pair import LEAST_NOISE_FLOOR, directed_evidence, surface_samples
from mvreg.geometry import se3
from mvreg.testing import blob_scans, blob_views, overlap
from mvreg.testing.scans import blob_scan, sensor_pose
from mvreg.testing.views import MOTION, degenerate_pairs, moved_view, pipeline, scaled_view
from mvreg.types import Scan


def right():
    pair = overlap()
    return ViewPair(pair.source, pair.target, pair.T_target_source)


def shifted(view_pair, resolutions, axis=2):
    """The view pair with the source moved in the target's frame."""
    pose = view_pair.T_target_source.copy()
    pose[axis, 3] += resolutions * view_pair.target.scale.resolution
    return replace(view_pair, T_target_source=pose)


def silent(view):
    """The view of a scan that knows no sensor; still oriented."""
    return replace(view, scan=Scan(view.name, view.scan.points))


def test_of_a_right_pose_everything_speaks_for_it():
    evidence = pool_evidence([right()])
    assert evidence.surface_overlap > 0.6
    assert evidence.residual < 1.5
    assert evidence.agreement > 0.95
    assert evidence.violation < 0.02
    assert evidence.sensor == "known"
    assert not evidence.ambiguous
    assert evidence.probability > 0.9
    assert "agree" in evidence.reason


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_residual_is_the_distance_over_the_noise_floor(axis):
    view_pair = right()
    before, after = pool_evidence([view_pair]), pool_evidence([shifted(view_pair, 1.0, axis)])
    assert after.residual > 3 * before.residual
    assert after.probability < before.probability
    assert after.noise == pytest.approx(before.noise, rel=0.2)


def test_a_surface_in_what_the_other_saw_to_be_free_is_a_violation():
    view_pair = right()
    towards = view_pair.target.scan.view_direction * 8 * view_pair.target.scale.resolution
    pose = view_pair.T_target_source.copy()
    pose[:3, 3] += towards
    evidence = pool_evidence([replace(view_pair, T_target_source=pose)])
    assert evidence.violation > 0.3
    assert evidence.probability < 0.01


def test_pooling_is_by_counts_and_the_order_does_not_matter():
    first, second = right(), shifted(right(), 1.5)
    alone = [pool_evidence([one]) for one in (first, second)]
    both = pool_evidence([first, second])
    assert both.points == sum(one.points for one in alone)
    squares = sum(one.points * one.residual**2 for one in alone)
    assert both.residual == pytest.approx(np.sqrt(squares / both.points))
    turned = pool_evidence([second, first])
    assert (both.points, both.surface_overlap) == (turned.points, turned.surface_overlap)
    assert both.probability == pytest.approx(turned.probability)


def test_overlap_is_that_of_the_view_with_all_the_others_together():
    source, first, second = blob_views()
    poses = blob_scans(3).poses

    def meet(target):
        return ViewPair(source, target, se3.invert(poses[target.name]) @ poses[source.name])

    covered = [
        directed_evidence(source, m.target, m.T_target_source).in_contact
        for m in (meet(first), meet(second))
    ]
    pooled = pool_evidence([meet(first), meet(second)])
    assert pooled.surface_overlap >= (covered[0] | covered[1]).mean()
    assert pooled.surface_overlap < covered[0].mean() + covered[1].mean()


def test_one_scan_held_by_two_strips_is_firmer_than_by_either():
    """Localizability pools in one frame, in the source's or the one that is given."""
    view_pair = right()
    alone = pool_evidence([view_pair]).localizability
    assert pool_evidence([view_pair, view_pair]).localizability == pytest.approx(alone)
    other = moved_view(view_pair.source, MOTION)
    same = ViewPair(other, view_pair.target, view_pair.T_target_source @ se3.invert(MOTION))
    # Two sources with one target meet in the target's frame, and neither frame matters.
    assert pool_evidence([view_pair, same]).localizability == pytest.approx(alone, rel=1e-3)
    third = moved_view(view_pair.target, MOTION)
    apart = ViewPair(other, third, MOTION @ view_pair.T_target_source @ se3.invert(MOTION))
    common = pool_evidence(
        [
            replace(view_pair, T_common_source=np.eye(4)),
            replace(apart, T_common_source=se3.invert(MOTION)),
        ]
    )
    assert common.localizability == pytest.approx(alone, rel=1e-3)


@pytest.mark.parametrize("noise", [0.0, 0.3, 1.0])
def test_a_sphere_is_ambiguous_however_noisy_it_is(noise):
    rng = np.random.default_rng(4)
    scans = []
    for index in range(2):
        scan = blob_scan(sensor_pose(40.0 * index), name=f"ball_{index}", relief=0.0)
        scans.append(replace(scan, points=scan.points + noise * rng.normal(size=scan.points.shape)))
    source, target = pipeline().prepare(scans, np.random.default_rng(0))
    evidence = pool_evidence([ViewPair(source, target, np.eye(4))])
    assert evidence.ambiguous
    assert evidence.probability == 0
    assert evidence.plausibility > 0.5
    assert evidence.reason.startswith("ambiguous")


def test_silent_scans_are_looked_at_with_an_estimate_and_merged_ones_not_at_all():
    pair = overlap()
    blind = pool_evidence(
        [ViewPair(silent(pair.source), silent(pair.target), pair.T_target_source)]
    )
    assert blind.sensor == "estimated"
    assert blind.violation < 0.03
    half = pool_evidence([ViewPair(silent(pair.source), pair.target, pair.T_target_source)])
    assert half.sensor == "known"
    assert set(blind.as_dict()) == {
        "surface_overlap", "residual", "noise", "agreement", "violation", "localizability",
        "residual_step",
        "points",
    }  # fmt: skip


def test_sensors_of_few_scans_of_many_say_nothing():
    def side(has_sensor, count, known=False):
        return SimpleNamespace(
            sensor_known=known, has_sensor=has_sensor, count=count, front=1, consistent=3
        )

    half = [side(True, 50), side(False, 50)]
    assert free_space_violation(half) == (0.25, "estimated")
    assert free_space_violation([*half, side(False, 50)]) == (None, "none")
    told = [side(True, 10, known=True), side(False, 90)]
    assert free_space_violation(told) == (0.25, "known")
    assert free_space_violation([side(False, 10)]) == (None, "none")


def test_far_apart_says_so_without_a_number_that_is_none():
    pair = overlap()
    away = pair.T_target_source.copy()
    away[0, 3] += 1e6
    evidence = pool_evidence([ViewPair(pair.source, pair.target, away)])
    assert (evidence.surface_overlap, evidence.points, evidence.probability) == (0.0, 0, 0.0)
    assert evidence.reason == "the scans barely overlap"
    assert pool_evidence([]).probability == 0
    assert pool_evidence([]).violation is None


@pytest.mark.parametrize("name", sorted(set(degenerate_pairs()) - {"both: far away"}))
def test_of_degenerate_views_nothing_is_probable(name):
    source, target = degenerate_pairs()[name]
    evidence = pool_evidence([ViewPair(source, target, np.eye(4))])
    assert np.isfinite(list(evidence.as_dict().values())).all()
    assert evidence.probability < 0.5


@pytest.mark.parametrize("unit", [1024.0, 1 / 1024])
def test_the_unit_of_length_does_not_matter(unit):
    view_pair = right()
    pose = view_pair.T_target_source.copy()
    pose[:3, 3] *= unit
    scaled = ViewPair(
        scaled_view(view_pair.source, unit), scaled_view(view_pair.target, unit), pose
    )
    assert pool_evidence([scaled]) == pool_evidence([view_pair])


def test_stray_points_are_not_asked():
    view = overlap().source
    outlier = (
        60.0 * np.random.default_rng(6).uniform(-1, 1, size=(len(view.points[::40]), 3)) + 90.0
    )
    spoilt = replace(
        view,
        points=np.concatenate([view.points, outlier]),
        normals=np.concatenate([view.normals, view.normals[::40]]),
    )
    sampled = surface_samples(spoilt).points
    assert (sampled[:, None] == view.points[None]).all(axis=2).any(axis=1).mean() > 0.99
    assert len(sampled) > 500


def test_a_view_is_made_ready_once_and_not_kept_alive():
    import gc
    import weakref

    view = replace(overlap().source)
    assert surface_samples(view) is surface_samples(view)
    assert surface_samples(view).noise_floor >= LEAST_NOISE_FLOOR * view.scale.resolution
    gone = weakref.ref(view)
    del view
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize("sensor", list(WEIGHTS))
def test_each_piece_of_evidence_counts_one_way_only(sensor):
    """More overlap never speaks against a pose, a larger residual or violation never for it."""
    usual = {"surface_overlap": 0.5, "residual": 2.0, "noise": 0.1, "agreement": 0.9,
    "violation": 0.05,
             "residual_step": 0.5}  # fmt: skip

    def chance(**changes):
        return probability(features(**(usual | changes)), sensor)

    assert chance(surface_overlap=0.6) >= chance() >= chance(surface_overlap=0.4)
    assert chance(agreement=0.95) >= chance() >= chance(agreement=0.8)
    assert chance(residual=1.5) >= chance() >= chance(residual=3.0)
    assert chance(residual_step=0.1) >= chance() >= chance(residual_step=3.0)
    assert chance(residual=6.0) < chance(residual=1.5)
    assert chance(violation=0.01) >= chance() >= chance(violation=0.2)
    assert len(WEIGHTS[sensor]) == 1 + len(FEATURES)


def test_the_residual_step_is_how_far_the_pose_is_from_the_best_one():
    view_pair = right()
    assert pool_evidence([view_pair]).residual_step < 0.3
    for length in (1.0, 2.0):
        for axis in range(3):
            residual_step = pool_evidence([shifted(view_pair, length, axis)]).residual_step
            assert residual_step == pytest.approx(length, rel=0.4)
    # Meetings that are off in opposite ways ask for nothing together.
    both = pool_evidence([shifted(view_pair, 1.0), shifted(view_pair, -1.0)])
    assert both.residual_step < 0.4


def test_what_is_not_measured_stays_finite():
    assert np.isfinite(features(0.0, 0.0, 0.0, 0.0, None, 0.0)).all()
    assert np.isfinite(features(1.0, 1e9, 1e9, 1.0, 1.0, 1e9)).all()
