"""Systematic errors of single scans, told from residuals; and none where there are none."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.errors import RecordError
from mvreg.geometry import se3
from mvreg.report.build import build_report
from mvreg.stages.adjust.joint.stage import JointRefinement
from mvreg.types import Pattern, Result

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
