"""The judges' formulas against numbers worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.stages.judge.residual import (
    PointToPlaneJudge,
    TmseJudge,
    TmseSurfaceJudge,
    Units,
)
from mvreg.surface.fit import localizability, surface_fit
from mvreg.testing.views import graph_of, overlap, plain_view, registration
from mvreg.types import Scale, ViewGraph

UP = np.array([0.0, 0.0, 1.0])


def flat(name="flat", resolution=1.0, height=0.0):
    """A 10 x 10 grid of step 1 at some height, with normals upwards."""
    grid = np.stack(np.meshgrid(np.arange(10.0), np.arange(10.0), [height]), -1).reshape(-1, 3)
    view = plain_view(name, grid, Scale(5.0, resolution))
    return replace(view, resolution=resolution)


def fit_with(mse, overlap_share=1.0):
    """A registration with a trimmed MSE and an overlap; the two surfaces are one."""
    source, target = flat("source"), flat("target")
    found = registration(source, target, np.eye(4))
    return replace(found, trimmed_mse=mse, overlap=overlap_share), source, target


@pytest.mark.parametrize(
    ("mse", "resolution", "accepted", "threshold", "reliable"),
    [
        (2.8, 1.4, [], 2.8, True),
        (2.81, 1.4, [], 2.8, False),
        (2.9, 1.4, [1.0, 3.0], 3.0, True),  # 1.5 times the mean, 2
        (3.1, 1.4, [1.0, 3.0], 3.0, False),
        (2.8, 1.4, [0.1, 0.1], 2.8, True),  # the larger of the two counts
        (1.9, 1.0, [], 2.0, True),
    ],
)
def test_eq_7_as_printed(mse, resolution, accepted, threshold, reliable):
    found, source, target = fit_with(mse)
    before = graph_of(*(replace(found, trimmed_mse=value) for value in accepted))
    judge = TmseJudge(2.0, 1.5, 0.0, Units.given)
    verdict = judge(found, source, replace(target, resolution=resolution), before)
    assert verdict.threshold == pytest.approx(threshold)
    assert verdict.score == mse
    assert verdict.reliable is reliable
    assert "Eq. (7)" in verdict.reason


@pytest.mark.parametrize("unit", [1.0, 1000.0, 1e-3])
def test_eq_7_without_units_is_the_printed_one_where_the_resolution_is_as_the_bunny_s(unit):
    """At a mean resolution of 1.4 mm in millimetres, and at the same shape in any other unit."""
    found, source, target = fit_with(2.5 * unit**2)
    scale = Scale(10.0 * unit, 1.4 * unit)
    source, target = replace(source, scale=scale), replace(target, resolution=1.3 * unit)
    judge = TmseJudge(2.0, 1.5, 0.0, Units.resolution, 1.4)
    verdict = judge(found, source, target, ViewGraph())
    assert verdict.threshold == pytest.approx(2 * 1.3 * unit**2)
    assert verdict.reliable
    assert not judge(
        replace(found, trimmed_mse=2.61 * unit**2), source, target, ViewGraph()
    ).reliable


def test_factors_are_parameters():
    found, source, target = fit_with(1.0)
    judge = TmseJudge(3.0, 4.0, 0.0, Units.given)
    assert judge(found, source, target, ViewGraph()).threshold == pytest.approx(3.0)
    assert judge(found, source, target, [found]).threshold == pytest.approx(4.0)


@pytest.mark.parametrize("judge", [TmseJudge, PointToPlaneJudge, TmseSurfaceJudge])
def test_too_little_overlap_is_not_relied_on(judge):
    found, source, target = fit_with(0.01, overlap_share=0.5)
    for least, reliable in [(0.0, True), (0.5, True), (0.51, False)]:
        free = {} if judge is TmseJudge else {"min_localizability": 0.0}  # a plane slides
        verdict = judge(min_overlap=least, **free)(found, source, target, ViewGraph())
        assert verdict.reliable is reliable
        if not reliable:
            assert verdict.reason == "overlap below 0.51"


@pytest.mark.parametrize(
    ("shift", "residual"), [((0, 0, 0), 0.0), ((0.3, 0.2, 0), 0.0), ((0, 0, 0.4), 0.4)]
)
def test_the_residual_is_the_distance_to_the_tangent_planes(shift, residual):
    source, target = flat("source"), flat("target")
    pose = se3.from_parts(np.eye(3), np.array(shift, dtype=float))
    found = registration(source, target, pose, reach=0.5)
    assert surface_fit(found, source, target) == (pytest.approx(residual, abs=1e-12), 1.0)
    coarse = replace(source, scale=Scale(5.0, 4.0))
    assert surface_fit(found, coarse, target)[0] == pytest.approx(residual / 4, abs=1e-12)


def test_the_agreement_is_the_mean_cosine():
    source, target = flat("source"), flat("target")
    half = len(source.points) // 2
    sideways = np.concatenate([np.tile(UP, (half, 1)), np.tile([1.0, 0, 0], (half, 1))])
    turned = replace(source, normals=sideways)
    found = registration(turned, target, np.eye(4))
    assert surface_fit(found, turned, target)[1] == pytest.approx(0.5)
    assert not PointToPlaneJudge(min_agreement=0.51, min_localizability=0)(
        found, turned, target, []
    ).reliable
    assert PointToPlaneJudge(min_agreement=0.49, min_localizability=0)(
        found, turned, target, []
    ).reliable


def test_where_signs_are_unknown_opposite_normals_agree():
    source, target = flat("source"), flat("target")
    below = replace(source, normals=-source.normals)
    found = registration(below, target, np.eye(4))
    assert surface_fit(found, below, target)[1] == pytest.approx(-1)
    blind = replace(below, features=replace(below.features, oriented=False))
    assert surface_fit(found, blind, target)[1] == pytest.approx(1)


def test_point_to_plane_says_what_is_wrong():
    source, target = flat("source"), flat("target")
    away = se3.from_parts(np.eye(3), np.array([0, 0, 0.7]))
    lifted = registration(source, target, away)
    verdict = PointToPlaneJudge(max_residual=0.5)(lifted, source, target, ViewGraph())
    assert (verdict.reliable, verdict.reason) == (False, "point-to-plane residual too large")
    assert (verdict.score, verdict.threshold) == (pytest.approx(0.7), 0.5)
    below = replace(source, normals=-source.normals)
    verdict = PointToPlaneJudge()(
        registration(below, target, np.eye(4)), below, target, ViewGraph()
    )
    assert (verdict.reliable, verdict.reason) == (False, "normals disagree")


@pytest.mark.parametrize("mse", [0.5, 50.0])
@pytest.mark.parametrize("gap", [0.1, 2.0])
def test_both_tests_must_pass(mse, gap):
    source, target = flat("source"), flat("target")
    lifted = registration(source, target, se3.from_parts(np.eye(3), np.array([0, 0, gap])))
    found = replace(lifted, trimmed_mse=mse)
    verdict = TmseSurfaceJudge()(found, source, target, ViewGraph())
    first = TmseJudge()(found, source, target, ViewGraph())
    second = PointToPlaneJudge()(found, source, target, ViewGraph())
    assert verdict.reliable is (first.reliable and second.reliable)
    assert (verdict.score, verdict.threshold) == (first.score, first.threshold)
    reasons = [v.reason for v in (first, second) if v.reliable is verdict.reliable]
    assert verdict.reason in reasons


def test_the_blob_is_judged_by_its_surface():
    pair = overlap()
    right = registration(pair.source, pair.target, pair.T_target_source)
    residual, agreement = surface_fit(right, pair.source, pair.target)
    assert residual < 0.2
    assert agreement > 0.95


def cap(count=2000):
    """Half a sphere of radius 10, which slides along itself, with exact normals."""
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(count, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    view = plain_view("cap", 10 * normals, Scale(5.0, 1.0))
    return replace(view, normals=normals)


@pytest.mark.parametrize("judge", [PointToPlaneJudge, TmseSurfaceJudge])
@pytest.mark.parametrize("shape", [cap, flat])
def test_what_slides_along_itself_is_ambiguous(judge, shape):
    view = shape()
    found = registration(view, view, np.eye(4))
    assert localizability(found, view, view) < 1e-9
    verdict = judge()(found, view, view, ViewGraph())
    assert not verdict.reliable
    assert "ambiguous" in verdict.reason
    assert judge(min_localizability=0.0)(found, view, view, ViewGraph()).reliable


def test_what_has_a_shape_is_stable_in_any_unit():
    pair = overlap()
    found = registration(pair.source, pair.target, pair.T_target_source)
    firm = localizability(found, pair.source, pair.target)
    assert firm > 0.003
    source, target = (replace(v, points=v.points * 1000) for v in (pair.source, pair.target))
    pose = pair.T_target_source.copy()
    pose[:3, 3] *= 1000
    large = localizability(replace(found, T_target_source=pose), source, target)
    assert large == pytest.approx(firm, rel=1e-6)
