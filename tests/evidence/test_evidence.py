"""The evidence of a pose: what each part of it measures, how it pools, what it cannot tell."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.evidence.calibration import FEATURES, WEIGHTS, features, probability
from mvreg.evidence.pooled import Meeting, weigh
from mvreg.evidence.view_pair import LEAST_FLOOR, look, witness
from mvreg.geometry import se3
from mvreg.testing import blob_scans, blob_views, overlap
from mvreg.testing.scans import blob_scan, sensor_pose
from mvreg.testing.views import MOTION, degenerate_pairs, moved_view, pipeline, scaled_view
from mvreg.types import Scan


def right():
    pair = overlap()
    return Meeting(pair.source, pair.target, pair.T_target_source)


def shifted(meeting, resolutions, axis=2):
    """The meeting with the source moved in the target's frame."""
    pose = meeting.T_target_source.copy()
    pose[axis, 3] += resolutions * meeting.target.scale.resolution
    return replace(meeting, T_target_source=pose)


def silent(view):
    """The view of a scan that knows no sensor; still oriented."""
    return replace(view, scan=Scan(view.name, view.scan.points))


def test_of_a_right_pose_everything_speaks_for_it():
    evidence = weigh([right()])
    assert evidence.overlap > 0.6
    assert evidence.residual < 1.5
    assert evidence.agreement > 0.95
    assert evidence.violation < 0.02
    assert evidence.sensor == "known"
    assert not evidence.ambiguous
    assert evidence.probability > 0.9
    assert "agree" in evidence.reason


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_residual_is_the_distance_over_the_noise_floor(axis):
    meeting = right()
    before, after = weigh([meeting]), weigh([shifted(meeting, 1.0, axis)])
    assert after.residual > 3 * before.residual
    assert after.probability < before.probability
    assert after.noise == pytest.approx(before.noise, rel=0.2)


def test_a_surface_in_what_the_other_saw_to_be_free_is_a_violation():
    meeting = right()
    towards = meeting.target.scan.view_direction * 8 * meeting.target.scale.resolution
    pose = meeting.T_target_source.copy()
    pose[:3, 3] += towards
    evidence = weigh([replace(meeting, T_target_source=pose)])
    assert evidence.violation > 0.3
    assert evidence.probability < 0.01


def test_pooling_is_by_counts_and_the_order_does_not_matter():
    first, second = right(), shifted(right(), 1.5)
    alone = [weigh([one]) for one in (first, second)]
    both = weigh([first, second])
    assert both.points == sum(one.points for one in alone)
    squares = sum(one.points * one.residual**2 for one in alone)
    assert both.residual == pytest.approx(np.sqrt(squares / both.points))
    turned = weigh([second, first])
    assert (both.points, both.overlap) == (turned.points, turned.overlap)
    assert both.probability == pytest.approx(turned.probability)


def test_overlap_is_that_of_the_view_with_all_the_others_together():
    source, first, second = blob_views()
    poses = blob_scans(3).poses

    def meet(target):
        return Meeting(source, target, se3.invert(poses[target.name]) @ poses[source.name])

    covered = [look(source, m.target, m.T_target_source).met for m in (meet(first), meet(second))]
    pooled = weigh([meet(first), meet(second)])
    assert pooled.overlap >= (covered[0] | covered[1]).mean()
    assert pooled.overlap < covered[0].mean() + covered[1].mean()


def test_one_scan_held_by_two_strips_is_firmer_than_by_either():
    """Stability pools in one frame, in the source's or the one that is given."""
    meeting = right()
    alone = weigh([meeting]).stability
    assert weigh([meeting, meeting]).stability == pytest.approx(alone)
    other = moved_view(meeting.source, MOTION)
    same = Meeting(other, meeting.target, meeting.T_target_source @ se3.invert(MOTION))
    # Two sources with one target meet in the target's frame, and neither frame matters.
    assert weigh([meeting, same]).stability == pytest.approx(alone, rel=1e-3)
    third = moved_view(meeting.target, MOTION)
    apart = Meeting(other, third, MOTION @ meeting.T_target_source @ se3.invert(MOTION))
    common = weigh(
        [
            replace(meeting, T_common_source=np.eye(4)),
            replace(apart, T_common_source=se3.invert(MOTION)),
        ]
    )
    assert common.stability == pytest.approx(alone, rel=1e-3)


@pytest.mark.parametrize("noise", [0.0, 0.3, 1.0])
def test_a_sphere_is_ambiguous_however_noisy_it_is(noise):
    rng = np.random.default_rng(4)
    scans = []
    for index in range(2):
        scan = blob_scan(sensor_pose(40.0 * index), name=f"ball_{index}", relief=0.0)
        scans.append(replace(scan, points=scan.points + noise * rng.normal(size=scan.points.shape)))
    source, target = pipeline().prepare(scans, np.random.default_rng(0))
    evidence = weigh([Meeting(source, target, np.eye(4))])
    assert evidence.ambiguous
    assert evidence.probability == 0
    assert evidence.plausibility > 0.5
    assert evidence.reason.startswith("ambiguous")


def test_silent_scans_are_looked_at_with_an_estimate_and_merged_ones_not_at_all():
    pair = overlap()
    blind = weigh([Meeting(silent(pair.source), silent(pair.target), pair.T_target_source)])
    assert blind.sensor == "estimated"
    assert blind.violation < 0.03
    half = weigh([Meeting(silent(pair.source), pair.target, pair.T_target_source)])
    assert half.sensor == "known"
    assert set(blind.as_dict()) == {
        "overlap", "residual", "noise", "agreement", "violation", "stability", "pull",
        "points",
    }  # fmt: skip


def test_far_apart_says_so_without_a_number_that_is_none():
    pair = overlap()
    away = pair.T_target_source.copy()
    away[0, 3] += 1e6
    evidence = weigh([Meeting(pair.source, pair.target, away)])
    assert (evidence.overlap, evidence.points, evidence.probability) == (0.0, 0, 0.0)
    assert evidence.reason == "the scans hardly meet"
    assert weigh([]).probability == 0
    assert weigh([]).violation is None


@pytest.mark.parametrize("name", sorted(set(degenerate_pairs()) - {"both: far away"}))
def test_of_degenerate_views_nothing_is_probable(name):
    source, target = degenerate_pairs()[name]
    evidence = weigh([Meeting(source, target, np.eye(4))])
    assert np.isfinite(list(evidence.as_dict().values())).all()
    assert evidence.probability < 0.5


@pytest.mark.parametrize("unit", [1024.0, 1 / 1024])
def test_the_unit_of_length_does_not_matter(unit):
    meeting = right()
    pose = meeting.T_target_source.copy()
    pose[:3, 3] *= unit
    scaled = Meeting(scaled_view(meeting.source, unit), scaled_view(meeting.target, unit), pose)
    assert weigh([scaled]) == weigh([meeting])


def test_stray_points_are_not_asked():
    view = overlap().source
    stray = 60.0 * np.random.default_rng(6).uniform(-1, 1, size=(len(view.points[::40]), 3)) + 90.0
    spoilt = replace(
        view,
        points=np.concatenate([view.points, stray]),
        normals=np.concatenate([view.normals, view.normals[::40]]),
    )
    asked = witness(spoilt).points
    assert (asked[:, None] == view.points[None]).all(axis=2).any(axis=1).mean() > 0.99
    assert len(asked) > 500


def test_a_view_is_made_ready_once_and_not_kept_alive():
    import gc
    import weakref

    view = replace(overlap().source)
    assert witness(view) is witness(view)
    assert witness(view).floor >= LEAST_FLOOR * view.scale.resolution
    gone = weakref.ref(view)
    del view
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize("sensor", list(WEIGHTS))
def test_each_piece_of_evidence_counts_one_way_only(sensor):
    """More overlap never speaks against a pose, a larger residual or violation never for it."""
    usual = {"overlap": 0.5, "residual": 2.0, "noise": 0.1, "agreement": 0.9, "violation": 0.05,
             "pull": 0.5}  # fmt: skip

    def chance(**changes):
        return probability(features(**(usual | changes)), sensor)

    assert chance(overlap=0.6) >= chance() >= chance(overlap=0.4)
    assert chance(agreement=0.95) >= chance() >= chance(agreement=0.8)
    assert chance(residual=1.5) >= chance() >= chance(residual=3.0)
    assert chance(pull=0.1) >= chance() >= chance(pull=3.0)
    assert chance(residual=6.0) < chance(residual=1.5)
    assert chance(violation=0.01) >= chance() >= chance(violation=0.2)
    assert len(WEIGHTS[sensor]) == 1 + len(FEATURES)


def test_the_pull_is_how_far_the_pose_is_from_the_best_one():
    meeting = right()
    assert weigh([meeting]).pull < 0.3
    for length in (1.0, 2.0):
        for axis in range(3):
            pull = weigh([shifted(meeting, length, axis)]).pull
            assert pull == pytest.approx(length, rel=0.4)
    # Meetings that are off in opposite ways ask for nothing together.
    both = weigh([shifted(meeting, 1.0), shifted(meeting, -1.0)])
    assert both.pull < 0.4


def test_what_is_not_measured_stays_finite():
    assert np.isfinite(features(0.0, 0.0, 0.0, 0.0, None, 0.0)).all()
    assert np.isfinite(features(1.0, 1e9, 1e9, 1.0, 1.0, 1e9)).all()
