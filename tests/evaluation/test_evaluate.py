import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.evaluation.pose_errors import consistency, pose_errors, result_errors
from mvreg.geometry import se3
from mvreg.surface import consistency as surface_consistency
from mvreg.surface import overlap
from mvreg.surface.consistency import fit_score
from mvreg.types import Features, Result, Scale, ScanSet, View


def turn(degrees: float, shift: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return se3.from_parts(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), np.array(shift, float))


def plate(name: str, height: float = 0.0, corner: tuple[float, float] = (0, 0)) -> View:
    """A flat square of 20 x 20 points, spacing 1, with normals +z."""
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    points = np.column_stack([x.ravel() + corner[0], y.ravel() + corner[1], np.full(400, height)])
    normals = np.tile([0.0, 0.0, 1.0], (400, 1))
    features = Features(np.empty((0, 3)), np.empty((0, 1, 3)), np.empty((0, 9)), True)
    return View(name, points, normals, features, 1.0, Scale(5.0, 1.0))


def test_mean_includes_the_reference():
    truth = {"a": np.eye(4), "b": np.eye(4), "c": np.eye(4)}
    poses = {"a": np.eye(4), "b": turn(2.0, (3, 4, 0)), "c": np.eye(4)}
    errors = pose_errors(poses, truth, "a")
    assert errors is not None
    # ||dR||_F = 2 sqrt(2) sin(angle / 2)
    expected = 2 * np.sqrt(2) * np.sin(np.radians(1.0))
    assert errors.scans["b"].rotation == pytest.approx(expected)
    assert errors.scans["b"].angle == pytest.approx(2.0)
    assert errors.max.rotation == pytest.approx(expected)
    assert errors.mean.rotation == pytest.approx(expected / 3)
    assert errors.mean.translation == pytest.approx(5 / 3)
    assert errors.max.translation == pytest.approx(5)
    assert errors.scans["a"].rotation == 0


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_right_poses_have_no_error_whatever_the_frame_of_the_truth(number: int):
    rng = np.random.default_rng(number)
    truth = {name: se3.random(rng, 10.0) for name in "abcd"}
    poses = {name: se3.invert(truth["c"]) @ truth[name] for name in "acbd"}
    errors = pose_errors(poses, truth, "c")
    assert errors is not None
    assert errors.frame == "c"
    assert errors.max.rotation < 1e-12
    assert errors.max.translation < 1e-12


def test_only_scans_with_truth_count():
    poses = {"a": np.eye(4), "b": turn(90), "c": turn(1)}
    errors = pose_errors(poses, {"a": np.eye(4), "c": np.eye(4), "lost": np.eye(4)}, "a")
    assert errors is not None
    assert list(errors.scans) == ["a", "c"]
    assert errors.max.angle == pytest.approx(1.0)


def test_reference_without_truth_falls_back_to_the_first_scan_that_has_one():
    truth = {"b": turn(40, (1, 2, 3)), "c": turn(70)}
    poses = {"a": np.eye(4), "b": turn(10), "c": turn(10) @ se3.invert(truth["b"]) @ truth["c"]}
    errors = pose_errors(poses, truth, "a")
    assert errors is not None
    assert errors.frame == "b"
    assert set(errors.scans) == {"b", "c"}
    assert errors.max.rotation < 1e-12


@pytest.mark.parametrize("truth", [None, {}, {"a": np.eye(4)}, {"x": np.eye(4), "y": np.eye(4)}])
def test_nothing_to_compare_is_none_and_not_zero(truth):
    assert pose_errors({"a": np.eye(4), "b": np.eye(4)}, truth, "a") is None


def test_a_partial_model_is_compared_in_its_own_frame():
    truth = {"b": turn(40, (1, 2, 3)), "c": turn(70), "d": turn(20, (9, 0, 0))}
    elsewhere = turn(123, (7, 7, 7))
    right = {name: elsewhere @ truth[name] for name in ("b", "c")}
    wrong = {**right, "c": right["c"] @ turn(3.0)}
    partly = {"x": np.eye(4), **right}  # the first scan has no truth
    parts = (right, wrong, partly, {"d": np.eye(4)})
    whole, found = result_errors(result_of(parts), ScanSet("s", (), poses=truth))
    assert whole is None
    assert [errors and errors.frame for errors in found] == ["b", "b", "b", None]
    assert found[0].max.rotation < 1e-12 and found[0].max.translation < 1e-12
    assert found[1].max.angle == pytest.approx(3.0)
    assert found[1].mean.angle == pytest.approx(1.5)
    assert found[2].max.rotation < 1e-12
    assert result_errors(result_of((right,)), ScanSet("s", ())) == (None, [None])


def result_of(components):
    return Result("x", {"x": np.eye(4)}, (), (), components=tuple(components))


def test_errors_are_told_for_the_frames_that_were_read():
    """Else how far a scan was moved away would decide how large its error of translation is."""
    truth = {"a": np.eye(4), "b": turn(40, (1, 2, 3))}
    found = {"a": np.eye(4), "b": truth["b"] @ turn(1.0)}
    motions = {"b": turn(77, (500, 0, 0))}
    back = {"b": se3.invert(motions["b"])}
    there = ScanSet("s", (), poses={**truth, "b": truth["b"] @ back["b"]}, motions=motions)
    moved = {**found, "b": found["b"] @ back["b"]}
    errors, _ = result_errors(Result("a", moved, (), ()), there)
    assert errors.max.angle == pytest.approx(1.0)
    assert errors.max.translation < 1e-9
    np.testing.assert_allclose(there.as_read(there.poses)["b"], truth["b"], atol=1e-9)


def test_objects_are_not_compared_with_each_other():
    truth = {"a": np.eye(4), "b": turn(40), "c": turn(10)}
    scans = ScanSet("s", (), poses=truth, objects={"a": "one", "b": "one", "c": "other"})
    errors, _ = result_errors(Result("a", {**truth, "c": turn(99)}, (), ()), scans)
    assert set(errors.scans) == {"a", "b"}


def test_consistency_of_two_plates_is_their_gap():
    views = [plate("a"), plate("b", height=0.25)]
    found = consistency({"a": np.eye(4), "b": np.eye(4)}, views)
    assert found is not None
    assert found.median == pytest.approx(0.25)
    assert found.rms == pytest.approx(0.25)
    assert found.relative_rms == pytest.approx(0.25 / found.resolution)
    assert (found.pairs, found.points) == (2, 800)


def test_consistency_measures_in_the_model_frame(rng):
    move = se3.random(rng, 100.0)
    b = plate("b", height=0.25)
    normals = b.normals @ move[:3, :3].T
    moved = View("b", se3.apply(move, b.points), normals, b.features, 1.0, b.scale)
    found = consistency({"a": np.eye(4), "b": se3.invert(move)}, [plate("a"), moved])
    assert found is not None
    assert found.median == pytest.approx(0.25)


def test_consistency_ignores_sliding_but_not_lifting():
    poses = {"a": np.eye(4), "b": turn(0, (0.3, 0.2, 0))}
    slid = consistency(poses, [plate("a"), plate("b")])
    lifted = consistency({"a": np.eye(4), "b": turn(0, (0, 0, 0.5))}, [plate("a"), plate("b")])
    assert slid is not None and lifted is not None
    assert slid.rms < 1e-12
    assert lifted.rms == pytest.approx(0.5)


def test_surfaces_that_cross_at_right_angles_are_no_overlap():
    upright = se3.from_parts(np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]), np.zeros(3))
    assert consistency({"a": np.eye(4), "b": upright}, [plate("a"), plate("b")]) is None


@pytest.mark.parametrize(
    "poses", [{}, {"a": np.eye(4)}, {"a": np.eye(4), "b": turn(0, (90, 0, 0))}]
)
def test_no_overlap_is_none(poses):
    assert consistency(poses, [plate("a"), plate("b")]) is None


def test_surfaces_that_meet_are_closer_than_ones_that_do_not():
    views = [plate("a"), plate("b"), plate("c")]
    still = {"a": np.eye(4), "b": np.eye(4), "c": turn(0, (90, 0, 0))}
    near = {**still, "c": turn(0, (0, 0, 0.5))}
    assert fit_score({"a": np.eye(4)}, views) == 0
    assert fit_score(still, views) == pytest.approx(2 * 400)
    # Two plates half a resolution off: each of four ordered pairs counts 3/4 a point.
    assert fit_score(near, views) == pytest.approx((2 + 4 * 0.75) * 400)
    assert consistency(near, views).rms > consistency(still, views).rms
    far = {**still, "c": turn(0, (0, 0, 1.5))}
    assert fit_score(far, views) == pytest.approx(fit_score(still, views)), "and never less"


def test_normals_that_are_not_numbers_are_left_out():
    a, b = plate("a"), plate("b", height=0.25)
    broken = b.normals.copy()
    broken[:100] = np.nan
    found = consistency(
        {"a": np.eye(4), "b": np.eye(4)},
        [a, View("b", b.points, broken, b.features, 1.0, b.scale)],
    )
    assert found is not None
    assert found.points == 600
    assert found.median == pytest.approx(0.25)


def test_far_pairs_cost_no_query(monkeypatch):
    views = [plate(str(k), corner=(15.0 * k, 0)) for k in range(12)]
    calls = []
    monkeypatch.setattr(
        surface_consistency,
        "contact_heights",
        lambda source, target, transform, reach, most: (
            calls.append((reach, most)),
            (np.empty(0, dtype=np.intp), np.empty(0)),
        )[1],
    )
    assert consistency({view.name: np.eye(4) for view in views}, views) is None
    chain = [(i, j) for i, j in itertools.permutations(range(12), 2) if abs(i - j) == 1]
    assert len(calls) == len(chain)
    assert set(calls) == {(3.0, overlap.MOST_POINTS)}


@pytest.mark.parametrize(("count", "most"), [(2, 1000), (16, 1000), (40, 400), (1000, 100)])
def test_fit_score_asks_fewer_points_a_pair_of_many_views(monkeypatch, count, most):
    views = [plate(str(k), corner=(0, 0)) for k in range(2)]
    far = [replace(views[0], name=f"far {k}") for k in range(count - 2)]
    calls, contact_heights = [], overlap.contact_heights
    monkeypatch.setattr(
        surface_consistency,
        "contact_heights",
        lambda *args: calls.append(args[-1]) or contact_heights(*args),
    )
    poses = {view.name: np.eye(4) for view in views}
    poses |= {
        v.name: se3.from_parts(np.eye(3), np.full(3, 1e3 * (k + 1))) for k, v in enumerate(far)
    }
    assert fit_score(poses, [*views, *far]) > 0
    assert calls == [most] * 2
