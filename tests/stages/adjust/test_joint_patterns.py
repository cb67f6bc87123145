"""Systematic errors of single scans, told from residuals; and none where there are none."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.errors import RecordError
from mvreg.geometry import se3
from mvreg.report.build import build_report
from mvreg.stages.adjust.joint.stage import JointRefinement
from mvreg.types import Pattern, Result, Scan, ScanScale

METHOD = mvreg.load_method()


def told(scanset, change=lambda name, points: points):
    """The patterns of scans that are refined from their true poses, by scan and kind."""
    scans = tuple(replace(s, points=change(s.name, s.points)) for s in scanset.scans)
    views = METHOD.pipeline.prepare(scans, np.random.default_rng(0))
    base = se3.invert(scanset.poses[views[0].name])
    poses = {view.name: base @ scanset.poses[view.name] for view in views}
    start = Result(views[0].name, poses, (), ())
    found = JointRefinement()(start, views, METHOD.pipeline)
    return {(pattern.scan, pattern.kind): pattern for pattern in found.patterns}


@pytest.fixture(scope="module")
def room():
    return mvreg.dataset("room")


@pytest.mark.parametrize("by", [3e-4, -3e-4])
def test_scans_of_another_scale_are_named_with_it(room, by):
    wrong = {room.scans[1].name, room.scans[4].name}
    found = told(room, lambda name, points: points * (1 + by * (name in wrong)))
    assert set(found) == {(name, "scale") for name in wrong}
    for pattern in found.values():
        assert pattern.size == pytest.approx(by, rel=0.25)
        assert 0 < pattern.deviation < abs(by) / 5
        assert f"{pattern.scan}: its scale is off by {pattern.size:+.1e}" in str(pattern)


def test_of_a_room_as_it_was_scanned_nothing_is_told(room):
    assert not told(room)


def test_a_bent_scan_is_named_with_how_far_it_is_bent():
    figurine = mvreg.dataset("figurine")
    wrong = figurine.scans[3]
    middle = wrong.points.mean(axis=0)
    towards = wrong.view_point - middle
    towards /= np.linalg.norm(towards)

    moved = []

    def bent(name, points):
        if name != wrong.name:
            return points
        apart = points - middle
        across = apart - np.outer(apart @ towards, towards)
        depth = 2.0 * (across**2).sum(axis=1) / (across**2).sum(axis=1).max()
        moved.append(depth.std())
        return points + np.outer(depth, towards)

    assert not told(figurine)
    found = told(figurine, bent)
    assert (wrong.name, "bend") in found
    assert found[wrong.name, "bend"].size == pytest.approx(moved[0], rel=0.5)


def test_the_report_and_its_remarks_have_them():
    from observed import apart, view_of

    found, before = apart()[0].scanset, apart()[-1]
    pattern = Pattern("b.ply", "bend", -0.25, 0.03)
    result = replace(before.result, patterns=(pattern,))
    about = {"method": "auto", "rng": 3, "seconds": {}, "config": {}}
    report = build_report(found, [view_of(scan) for scan in found.scans], result, **about)
    assert report["patterns"] == [
        {"scan": "b.ply", "kind": "bend", "size": -0.25, "deviation": 0.03}
    ]
    assert str(pattern) in report["remarks"]
    assert str(pattern).startswith("b.ply: it is bent beside the others: points are off by -0.25")


def test_a_pattern_of_another_kind_is_refused():
    with pytest.raises(RecordError, match=r"expected one of scale, bend, got 'twist'"):
        Pattern("a", "twist", 1.0, 0.1)


@pytest.mark.parametrize("name", ["room", "figurine"])
@pytest.mark.parametrize("origin", [0.0, 1e5])
def test_scales_come_back_and_poses_with_them(name, origin):
    scanset = mvreg.dataset(name)
    away = se3.from_parts(np.eye(3), np.array([origin, -origin, 0.0]))
    scanset = replace(
        scanset,
        scans=tuple(scan.moved(away) for scan in scanset.scans),
        poses={scan: pose @ se3.invert(away) for scan, pose in scanset.poses.items()},
    )
    off = {scan.name: 3e-4 * ((1, -1, 0)[k % 3]) for k, scan in enumerate(scanset.scans)}
    middles = {scan.name: scan.points.mean(axis=0) for scan in scanset.scans}
    scans = [
        replace(s, points=middles[s.name] + (s.points - middles[s.name]) * (1 + off[s.name]))
        for s in scanset.scans
    ]
    views = METHOD.pipeline.prepare(scans, np.random.default_rng(0))
    base = se3.invert(scanset.poses[views[0].name])
    poses = {view.name: base @ scanset.poses[view.name] for view in views}
    start = Result(views[0].name, poses, (), ())
    plain, scaled = (
        JointRefinement(scale=scale)(start, views, METHOD.pipeline) for scale in (False, True)
    )
    assert not plain.scales
    assert {scale.scan for scale in scaled.scales} == set(poses)
    gaps = [s.factor - 1 / (1 + off[s.scan]) for s in scaled.scales]
    deviations = [s.deviation for s in scaled.scales]
    assert max(deviations) < 1e-4
    assert np.sqrt(np.mean(np.divide(gaps, deviations) ** 2)) < 2
    assert np.mean(np.log([s.factor for s in scaled.scales])) == pytest.approx(0, abs=1e-9)
    assert error(scaled, poses, middles) < 0.7 * error(plain, poses, middles)
    if not origin:
        assert normalised(scaled, poses) < 12


def error(result, poses, middles):
    """RMS of how far the middles of the scans are from where they belong (length)."""
    gaps = [se3.apply(result.poses[name], middles[name]) - se3.apply(pose, middles[name])
            for name, pose in poses.items()]  # fmt: skip
    return np.sqrt(np.mean(np.square(gaps)))


def normalised(result, poses):
    """The mean squared error of poses in units of their covariance, 6 where that holds."""
    found = []
    for name, pose in poses.items():
        if name != result.reference:
            gap = se3.log(result.poses[name] @ se3.invert(pose))
            found.append(gap @ np.linalg.solve(result.covariances[name], gap))
    return np.mean(found)


def test_scales_that_nothing_tells_stay_one():
    """Of two planes: any scale lies on them."""
    grid = np.stack(np.meshgrid(np.arange(40.0), np.arange(40.0)), axis=-1).reshape(-1, 2)
    scans = []
    for number in range(3):
        height = 0.02 * np.random.default_rng(number).normal(size=len(grid))
        scans.append(Scan(str(number), np.column_stack([grid, height]), view_direction=(0, 0, 1)))
    views = METHOD.pipeline.prepare(scans, np.random.default_rng(0))
    start = Result("0", {view.name: np.eye(4) for view in views}, (), ())
    found = JointRefinement(scale=True)(start, views, METHOD.pipeline)
    for scale in found.scales:
        assert scale.factor == 1
        assert not scale.off
        assert scale.deviation > 1e-3


def test_only_scales_that_are_off_are_remarked_upon():
    off, right = ScanScale("a", 1.0003, 1e-5), ScanScale("b", 1.00003, 1e-5)
    assert off.off
    assert not right.off
    assert (
        str(off)
        == "a: its points are to be taken times 1+3.0e-04 (+-1.0e-05) beside those of the others"
    )
