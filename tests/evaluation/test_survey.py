"""What surveyors ask of a registration."""

from __future__ import annotations

import numpy as np
import pytest

import mvreg
from mvreg.evaluation.records import Uncertainty
from mvreg.evaluation.survey import (
    LinkSurvey,
    level_of_accuracy,
    loop_closures,
    survey_links,
)
from mvreg.geometry import se3


@pytest.fixture(scope="module")
def tiny():
    scans = mvreg.dataset("tiny", scramble=True, rng=2)
    return scans, mvreg.prepare(scans)


def test_that_right_poses_close_their_loops(tiny):
    scans, views = tiny
    links = survey_links(scans.poses, views)
    assert len(links) > 8
    loops = loop_closures(links)
    assert len(loops) >= 3
    assert loops[0].translation < 0.3 * views[0].scale.resolution
    assert all(len(loop.names) >= 3 for loop in loops)
    for link in links:
        assert 0 < link.rms < link.p95 < 3 * views[0].scale.resolution
        assert np.linalg.norm(link.weakest_axis) == pytest.approx(1)
        assert 0 < link.weakest_sigma < (0.1 if link.points > 500 else 2)


def test_that_a_scan_out_of_place_opens_its_loops(tiny):
    scans, views = tiny
    names = [scan.name for scan in scans.scans]
    shift = se3.from_parts(np.eye(3), np.array([0.6, 0, 0]))
    poses = {**scans.poses, names[2]: shift @ scans.poses[names[2]]}
    right, wrong = (
        {frozenset((one.source, one.target)): one for one in survey_links(each, views)}
        for each in (scans.poses, poses)
    )
    moved = [wrong[pair].twist[3:] - right[pair].twist[3:] for pair in wrong if names[2] in pair]
    assert len(moved) >= 2
    # Its links want it back, as its source or, with the other sign, its target.
    sizes = [abs(twist[0]) for twist in moved]
    assert np.median(sizes) == pytest.approx(0.6, rel=0.35)


def link(source, target, turn=(0, 0, 0), shift=(0, 0, 0), centre=(0, 0, 0), points=100):
    twist = np.array([*turn, *shift], dtype=float)
    return LinkSurvey(
        source, target, points, 1, 1, np.eye(3)[0], 1, twist, np.array(centre, dtype=float), 0.1
    )


def test_loops_by_hand():
    # a moves by +x of b, b by +x of c, a by +2x of c: it closes.
    closed = [
        link("a", "b", shift=(1, 0, 0), points=200),
        link("b", "c", shift=(1, 0, 0), points=200),
        link("a", "c", shift=(2, 0, 0)),
    ]
    (loop,) = loop_closures(closed)
    assert set(loop.names) == set("abc")
    assert loop.translation == pytest.approx(0) and loop.angle == pytest.approx(0)
    (loop,) = loop_closures([*closed[:2], link("c", "a", turn=(0, 0, 0.01), shift=(-1, 0, 0))])
    assert loop.angle == pytest.approx(np.degrees(0.01))
    assert loop.translation == pytest.approx(1)
    assert loop_closures(closed[:2]) == []
    # A turn about a far centre is a shift in the middle of the loop.
    (loop,) = loop_closures(
        [link("a", "b", points=200), link("b", "c", points=200),
         link("c", "a", turn=(0, 0, 0.01), centre=(300, 0, 0))]
    )  # fmt: skip
    assert loop.translation == pytest.approx(2)


def test_a_loop_without_a_triangle():
    around = [link(a, b, shift=(0, 0.5, 0), points=200) for a, b in ("ab", "bc", "cd")]
    (loop,) = loop_closures([*around, link("d", "a")])
    assert sorted(loop.names) == list("abcd")
    assert loop.translation == pytest.approx(1.5)


def test_uncertainty_along_the_axes():
    covariance = np.zeros((6, 6))
    covariance[2, 2] = 1e-6  # about z, by a milliradian
    covariance[5, 5] = 4.0
    pose = se3.from_parts(np.eye(3), np.array([100.0, 0, 0]))
    found = Uncertainty.of(covariance, pose, np.array([[-1.0, 0, 0], [1.0, 0, 0]]))
    np.testing.assert_allclose(found.axes_95, 1.959964 * np.array([0, 0.1, 2]), atol=1e-12)
    assert found.translation == pytest.approx(np.sqrt(4.01))


@pytest.mark.parametrize(
    ("error", "unit", "level"),
    [(1, "mm", "LOA50"), (0.0012, "m", "LOA40"), (1.6, "cm", "LOA20"), (10, "in", "none"),
     (0.1, "ft", "LOA20"), (1, "file", None), (np.nan, "mm", None)],
)  # fmt: skip
def test_levels_of_accuracy(error, unit, level):
    assert level_of_accuracy(error, unit) == level
