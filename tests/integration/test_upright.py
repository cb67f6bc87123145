"""Levelled scans: every stage keeps to the vertical, and a wrong one places nothing wrongly."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mvreg
from mvreg.geometry import se3
from mvreg.geometry.vertical import tilt
from mvreg.run import load_method
from mvreg.stages.refine.planes import GeneralizedICP, PointToPlane, SymmetricICP
from mvreg.stages.refine.trimmed import ICP, MOST_TILT, FractionalICP, TrimmedICP
from mvreg.types import Model, Scan, ScanSet, View

REFINEMENTS = (
    ICP(), TrimmedICP(), FractionalICP(), PointToPlane(), SymmetricICP(), GeneralizedICP(),
)  # fmt: skip


@cache
def room(upright: bool = True) -> ScanSet:
    return mvreg.dataset("room", scans=4, rays=8000, upright=upright, scramble=True)


@cache
def views(upright: bool = True) -> tuple[View, ...]:
    return tuple(mvreg.prepare(room(upright)))


def truth(source: View, target: View) -> np.ndarray:
    poses = room().poses or {}
    return se3.invert(poses[target.name]) @ poses[source.name]


def tilted(scan: Scan, degrees: float) -> Scan:
    """The same scan, of a scanner that was not levelled."""
    across = np.cross(scan.up, [0.3, 0.5, 0.8])
    across *= np.radians(degrees) / np.linalg.norm(across)
    turn = se3.exp(np.append(across, np.zeros(3)))
    return replace(scan, up=turn[:3, :3] @ scan.up)


def test_candidates_are_level():
    pipeline = load_method().pipeline
    source, target = views()[:2]
    found = pipeline.propagate(
        source, target, pipeline.seed(source, target), np.random.default_rng(0)
    )
    assert len(found) > 1
    np.testing.assert_allclose(tilt(found.poses, source.up, target.up), 0, atol=1e-5)
    angles = np.degrees(se3.rotation_angle(found.poses, truth(source, target)))
    assert angles.min() < 5


@pytest.mark.parametrize("refine", REFINEMENTS, ids=lambda stage: type(stage).__name__)
def test_refined_poses_tilt_little_and_have_their_own_pairs(refine):
    source, target = views()[:2]
    right = truth(source, target)
    near = refine(source, target, right)
    free = refine(
        *(replace(view, scan=replace(view.scan, up=None)) for view in (source, target)), right
    )
    np.testing.assert_array_equal(near.T_target_source, free.T_target_source)
    assert near.objective == free.objective
    wrong = replace(source, scan=tilted(source.scan, 12.0))
    found = refine(wrong, target, right)
    assert tilt(found.T_target_source, wrong.up, target.up) == pytest.approx(MOST_TILT, abs=1e-6)
    moved = se3.apply(found.T_target_source, source.points[found.pairs[:, 0]])
    gaps = np.linalg.norm(moved - target.points[found.pairs[:, 1]], axis=1)
    np.testing.assert_allclose(found.distances, gaps, atol=1e-9)
    assert found.objective > near.objective


def test_a_model_has_the_vertical_of_its_first_part():
    first, second = views()[:2]
    model = Model.of(first)
    np.testing.assert_array_equal(model.up, first.up)
    pipeline = load_method().pipeline
    found = pipeline.refine(second, model, truth(second, first))
    np.testing.assert_array_equal(pipeline.augment(model, second, found).up, first.up)
    assert Model.of(replace(first, scan=None)).up is None
    blind = Model.of(replace(first, scan=replace(first.scan, up=None)))
    merged = pipeline.augment(blind, second, found)
    np.testing.assert_allclose(merged.up, found.T_target_source[:3, :3] @ second.up)


def test_a_scan_that_is_not_level_is_not_placed():
    """Its true pose is not among those that are tried, and no other is taken for it."""
    scans = list(room().scans)
    scans[3] = tilted(scans[3], 40.0)
    result = mvreg.register(scans)
    poses = room().poses or {}
    joined = [part for part in (result.poses, *result.components) if scans[3].name in part]
    assert all(len(part) == 1 for part in joined)
    assert joined or scans[3].name in result.unregistered
    first = result.reference
    for name, pose in result.poses.items():
        right = se3.invert(poses[first]) @ poses[name]
        assert np.degrees(se3.rotation_angle(pose, right)) < 2
