"""Alternatives that a symmetry makes: found for a box, not for a blob."""

from functools import cache

import numpy as np

import mvreg
from mvreg.geometry import se3
from mvreg.stages.refine.planes import PointToPlane
from mvreg.stages.strategy.best_first.symmetry import symmetry_hypotheses
from mvreg.testing.views import degenerate_pairs, overlap, registration


@cache
def box():
    """Two views of a box, 30 degrees apart, prepared, and ``T_target_source``."""
    scans = mvreg.dataset("figurine", shape="box", views=12, points=4000)
    pipeline = mvreg.load_method("auto").pipeline
    views = pipeline.prepare(scans.scans[:3], np.random.default_rng(0))
    truth = se3.invert(scans.poses[views[0].name]) @ scans.poses[views[1].name]
    return views[1], views[0], truth


def test_a_box_has_alternatives_half_a_turn_away():
    source, target, truth = box()
    own = PointToPlane()(source, target, truth)
    alternatives = symmetry_hypotheses(own, source, target, PointToPlane())
    assert len(alternatives)
    angles = np.degrees(se3.rotation_angle(alternatives, own.T_target_source))
    assert (angles > 60).any()


def test_a_blob_has_none():
    pair = overlap()
    own = PointToPlane()(pair.source, pair.target, pair.T_target_source)
    alternatives = symmetry_hypotheses(own, pair.source, pair.target, PointToPlane())
    angles = np.degrees(se3.rotation_angle(alternatives, own.T_target_source))
    assert (angles < 5).all(), "nothing but the pose itself fits"


def test_degenerate_views_are_no_error():
    for source, target in degenerate_pairs().values():
        found = registration(source, target, np.eye(4))
        alternatives = symmetry_hypotheses(found, source, target, PointToPlane())
        assert alternatives.shape[1:] == (4, 4)
        assert np.isfinite(alternatives).all()
