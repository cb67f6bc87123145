"""What is said of poses without any ground truth."""

from dataclasses import replace

import numpy as np
import pytest

import mvreg
from mvreg.errors import InputError
from mvreg.evaluation.assess import TOLERANCE, assess
from mvreg.evaluation.component import in_loops
from mvreg.evaluation.grade import Grade, grade
from mvreg.evaluation.records import Uncertainty
from mvreg.evidence.calibration import LOOP, in_a_loop
from mvreg.evidence.pooled import pool_evidence
from mvreg.geometry import se3
from mvreg.run import Method
from mvreg.surface.contact import axis_strength, contacts
from mvreg.testing import blob_scans
from mvreg.testing.compare import digest
from mvreg.testing.views import (
    blob_views,
    degenerate_views,
    moved_view,
    pipeline,
    scaled_pose,
    scaled_view,
)
from mvreg.types import Pair, Result, Verdict


def truth() -> dict[str, np.ndarray]:
    """Exact poses of the blob's views in the frame of the first."""
    poses = blob_scans(3).poses or {}
    first = se3.invert(poses["blob_0"])
    return {view.name: first @ poses[view.name] for view in blob_views()}


def result(poses=None, **changes) -> Result:
    return Result("blob_0", truth() if poses is None else poses, (), (), **changes)


def turned(name: str, degrees: float) -> dict[str, np.ndarray]:
    """The poses, of which one is turned about its own z axis."""
    poses = truth()
    poses[name] = poses[name] @ se3.exp(np.array([0, 0, np.radians(degrees), 0, 0, 0]))
    return poses


def test_right_poses_are_green():
    found = assess(result(), blob_views())
    assert set(found.scans) == {"blob_0", "blob_1", "blob_2"}
    assert [scan.grade for scan in found.scans.values()] == [Grade.green] * 3
    for scan in found.scans.values():
        assert scan.component == 1
        assert scan.confidence > 0.95
        assert scan.coverage > 0.7
        assert scan.inlier_ratio > 0.9
        assert min(scan.strength) > 0.2 and max(scan.strength) <= 1
        assert 0 < scan.rms < found.tolerance
        assert scan.uncertainty is None
    assert found.tolerance == TOLERANCE * blob_views()[0].scale.resolution


def test_the_tolerance_follows_the_noise():
    """Right poses of noisy scans are within it too, and those of scans without are not laxer."""
    quiet, noisy = (
        pipeline().prepare(blob_scans(3, noise=noise).scans, np.random.default_rng(0))
        for noise in (0.02, 1.0)
    )
    assert assess(result(), quiet).tolerance == TOLERANCE * quiet[0].scale.resolution
    found = assess(result(), noisy)
    own = noisy[0].scale.resolution
    assert 1.2 * TOLERANCE * own < found.tolerance < 2 * own
    assert all(scan.inlier_ratio > 0.8 for scan in found.scans.values())


def test_pairs_that_overlap_are_listed_once():
    links = assess(result(), blob_views()).links
    pairs = {frozenset((link.source, link.target)) for link in links}
    assert len(links) == len(pairs) == 3
    next_to, across = (
        next(k for k in links if {k.source, k.target} == set(pair))
        for pair in [("blob_0", "blob_1"), ("blob_0", "blob_2")]
    )
    assert next_to.contact_ratio > across.contact_ratio + 0.1, "40 degrees apart, and 80"
    assert next_to.confidence > 0.9
    assert 0 < next_to.rms < blob_views()[0].scale.resolution


def test_pairs_that_hardly_overlap_are_not_listed():
    """Of scans 40 degrees apart, those at opposite sides share their rims at most."""
    poses = blob_scans(6).poses or {}
    first = se3.invert(poses["blob_0"])
    placed = {name: first @ pose for name, pose in poses.items()} | {"blob_0": np.eye(4)}
    views = blob_views(6)
    links = {
        frozenset((link.source, link.target)): link.contact_ratio
        for link in assess(result(placed), views).links
    }
    met = {frozenset((c.source.name, c.target.name)) for c in contacts(placed, views)}
    assert frozenset(("blob_0", "blob_4")) in met - set(links)
    assert set(links) < met and min(links.values()) >= 0.1


def test_an_ambiguous_pose_is_red_however_good_all_else_is(monkeypatch):
    assert assess(result(), blob_views()).scans["blob_1"].grade is Grade.green
    monkeypatch.setattr(
        "mvreg.evaluation.component.pool_evidence", lambda pairs: Doubtful(pool_evidence(pairs))
    )
    monkeypatch.setattr("mvreg.evaluation.component._is_red", lambda *_: False)
    found = assess(result(), blob_views()).scans["blob_1"]
    assert found.confidence > 0.95 and found.grade is Grade.red


class Doubtful:
    """Evidence that is ambiguous, for all else the evidence that it is made of."""

    def __init__(self, evidence):
        self.evidence, self.ambiguous = evidence, True

    def __getattr__(self, name):
        return getattr(self.evidence, name)


def test_a_wrong_pose_is_red_and_a_right_one_beside_it_is_not():
    found = assess(result(turned("blob_2", 40)), blob_views()).scans
    assert found["blob_2"].grade is Grade.red
    assert found["blob_2"].confidence < 0.5
    assert found["blob_2"].inlier_ratio < 0.6
    # What the wrong one meets does not count against the others.
    right = assess(result(), blob_views()).scans
    for name in ("blob_0", "blob_1"):
        assert found[name].grade is Grade.green
        assert found[name].inlier_ratio == pytest.approx(right[name].inlier_ratio, abs=0.05)


def test_two_scans_that_contradict_each_other_are_both_red():
    poses = {name: pose for name, pose in turned("blob_1", 40).items() if name != "blob_2"}
    found = assess(result(poses), blob_views()).scans
    assert [scan.grade for scan in found.values()] == [Grade.red] * 2
    assert all(scan.coverage > 0 for scan in found.values()), "nor is either without contact"


@pytest.mark.parametrize("degrees", [4.0, 8.0])
def test_a_pose_that_is_a_little_off_is_not_green(degrees):
    """The confidence may still hold it for right; the share within tolerance does not."""
    exact = assess(result(), blob_views()).scans["blob_2"]
    found = assess(result(turned("blob_2", degrees)), blob_views()).scans["blob_2"]
    assert found.inlier_ratio < exact.inlier_ratio - 0.1
    assert found.grade is not Grade.green


def test_every_component_is_looked_at_by_itself():
    views = blob_views(4)
    poses = blob_scans(4).poses or {}
    left, right = (
        {n: poses[n] for n in pair} for pair in (("blob_0", "blob_1"), ("blob_2", "blob_3"))
    )
    found = assess(Result("blob_0", left, (), (), components=(right,)), views)
    assert {name: scan.component for name, scan in found.scans.items()} == {
        "blob_0": 1, "blob_1": 1, "blob_2": 2, "blob_3": 2,
    }  # fmt: skip
    assert [(link.component, link.source[-1] + link.target[-1]) for link in found.links] == [
        (1, "01"), (2, "23"),
    ]  # fmt: skip


def test_a_scan_alone_has_no_grade_and_one_that_touches_nothing_is_red():
    alone = assess(result({"blob_0": np.eye(4)}), blob_views())
    assert alone.links == ()
    assert alone.scans["blob_0"].grade is None
    assert alone.scans["blob_0"].confidence is None
    away = truth()
    away["blob_1"] = se3.from_parts(np.eye(3), np.full(3, 1e4))
    found = assess(result(away), blob_views()).scans["blob_1"]
    assert (found.grade, found.confidence, found.inlier_ratio, found.rms) == (
        Grade.red,
        None,
        None,
        None,
    )
    assert (found.coverage, found.strength) == (0.0, (0.0, 0.0, 0.0))


def test_nothing_depends_on_the_unit_of_length():
    factor = 1 / 1024
    covariances = {"blob_1": np.diag([1e-6, 1e-6, 1e-6, 1e-2, 1e-2, 1e-2])}
    scale = np.diag([1, 1, 1, factor, factor, factor])
    small = {"blob_1": scale @ covariances["blob_1"] @ scale}
    one = assess(result(covariances=covariances), blob_views())
    other = assess(
        result({n: scaled_pose(T, factor) for n, T in truth().items()}, covariances=small),
        [scaled_view(view, factor) for view in blob_views()],
    )
    for name, scan in one.scans.items():
        assert other.scans[name] == replace(
            scan,
            rms=scan.rms * factor,
            confidence=pytest.approx(scan.confidence),
            uncertainty=scan.uncertainty
            and replace(
                scan.uncertainty,
                translation=pytest.approx(scan.uncertainty.translation * factor),
                axes_95=pytest.approx(np.array(scan.uncertainty.axes_95) * factor),
            ),
        )
    assert [link.rms * factor for link in one.links] == [link.rms for link in other.links]


def test_nothing_depends_on_the_model_frame():
    move = se3.random(np.random.default_rng(1), 100.0)
    moved = assess(result({n: move @ T for n, T in truth().items()}), blob_views())
    for name, scan in assess(result(), blob_views()).scans.items():
        assert moved.scans[name].inlier_ratio == pytest.approx(scan.inlier_ratio, abs=0.01)
        assert moved.scans[name].coverage == pytest.approx(scan.coverage, abs=0.01)
        assert moved.scans[name].strength == pytest.approx(scan.strength, abs=0.01)


def method() -> Method:
    """Stages for small scans, and the strategy and adjustment of a named method."""
    named = mvreg.load_method("fcpma")
    return replace(named, pipeline=pipeline())


def test_what_was_registered_is_not_prepared_again(monkeypatch):
    scans = blob_scans(3)
    found = mvreg.register(scans, method())
    assert [view.name for view in found.views] == [scan.name for scan in scans.scans]
    expected = assess(replace(found, views=()), found.views)
    assert "views=" not in repr(found)

    def forbidden(*_):
        raise AssertionError("prepared again")

    monkeypatch.setattr(mvreg.Pipeline, "prepare", forbidden)
    copies = [replace(scan, points=scan.points.copy()) for scan in scans.scans]
    for given in ((), (scans,), (copies,)):
        again = mvreg.assess(found, *given)
        assert (again.scans, again.links) == (expected.scans, expected.links)


def test_a_result_is_assessed_by_the_views_of_its_own_method():
    scans = blob_scans(3)
    changes = {"downsample": "voxel"}
    found = mvreg.register(scans, "fcpma", changes=changes)
    assert digest(found.views) == digest(tuple(mvreg.prepare(scans, "fcpma", changes=changes)))
    others = mvreg.prepare(scans)
    assert [len(view.points) for view in others] != [len(view.points) for view in found.views]
    assert mvreg.assess(found, scans).tolerance == mvreg.assess(found, found.views).tolerance
    assert mvreg.assess(found, scans).tolerance != mvreg.assess(found, others).tolerance


def test_prepared_scans_are_those_that_register_makes():
    found = mvreg.register(blob_scans(3), method(), rng=3)
    assert digest(tuple(mvreg.prepare(blob_scans(3), method(), rng=3))) == digest(found.views)


def test_scans_that_are_not_those_of_the_result_are_refused():
    scans = blob_scans(3)
    own = result(views=blob_views())
    assert mvreg.assess(own, scans).scans["blob_1"].grade is Grade.green
    moved = [scan.moved(se3.exp(np.full(6, 0.1))) for scan in scans.scans]
    with pytest.raises(InputError, match=r"blob_0 is not one .*mvreg\.prepare"):
        mvreg.assess(own, moved)
    with pytest.raises(InputError, match=r"has none.*mvreg\.prepare"):
        mvreg.assess(result(), scans)
    with pytest.raises(InputError, match=r"places blob_0, blob_1, blob_2.*mvreg\.prepare"):
        mvreg.assess(result())
    with pytest.raises(InputError, match=r"places blob_2, which is not among"):
        mvreg.assess(result(), blob_views()[:2])


@pytest.mark.parametrize("kind", sorted(degenerate_views()))
def test_poor_scans_get_an_honest_answer(kind):
    poor = replace(degenerate_views()[kind], name="poor")
    poses = {**truth(), poor.name: truth()["blob_0"]}
    scan = assess(result(poses), [*blob_views(), poor]).scans[poor.name]
    numbers = [
        scan.coverage,
        *scan.strength,
        *(x for x in (scan.inlier_ratio, scan.rms) if x is not None),
    ]
    assert np.isfinite(numbers).all()
    assert kind in ("no keypoints", "one keypoint") or scan.grade is not Grade.green


def test_strength_tells_what_is_held(rng):
    def spread(rows):
        return np.array(rows, float) / np.linalg.norm(rows, axis=1, keepdims=True)

    floor = np.tile([0.0, 0, 1], (50, 1))
    assert axis_strength(floor) == pytest.approx((0, 0, 1), abs=1e-6)
    # A slanted plane holds along none of the axes: the scan can give way along the others.
    assert axis_strength(spread(np.ones((50, 3)))) == pytest.approx((0, 0, 0), abs=1e-6)
    tube = spread(
        [(np.cos(a), np.sin(a), 0) for a in np.linspace(0, 2 * np.pi, 60, endpoint=False)]
    )
    assert axis_strength(tube) == pytest.approx((1, 1, 0), abs=1e-6)
    ball = spread(rng.normal(size=(5000, 3)))
    assert min(axis_strength(ball)) > 0.95
    assert axis_strength(-ball) == axis_strength(ball)
    assert axis_strength(np.empty((0, 3))) == (0.0, 0.0, 0.0)


def test_uncertainty_is_that_of_the_scan_s_own_middle():
    view = blob_views()[1]
    pose = se3.from_parts(np.eye(3), np.array([1000.0, 0, 0]))
    covariance = np.zeros((6, 6))
    covariance[2, 2] = np.radians(0.1) ** 2  # a turn about the model's z axis
    poses = {"blob_0": np.eye(4), "blob_1": pose}
    found = assess(result(poses, covariances={"blob_1": covariance}), blob_views()).scans
    uncertainty = found["blob_1"].uncertainty
    assert uncertainty.rotation == pytest.approx(0.1)
    lever = np.linalg.norm(se3.apply(pose, view.points.mean(axis=0))[:2])
    assert uncertainty.translation == pytest.approx(np.radians(0.1) * lever)
    assert found["blob_0"].uncertainty is None


def test_a_turn_about_the_scan_s_own_middle_does_not_move_it():
    view = blob_views()[1]
    pose = se3.from_parts(np.eye(3), np.array([1000.0, 200.0, 0]))
    turn = se3.about(
        se3.apply(pose, view.points.mean(axis=0)), se3.exp(np.array([0, 1e-3, 1e-3, 0, 0, 0]))
    )
    twist = se3.log(turn)
    uncertainty = Uncertainty.of(np.outer(twist, twist), pose, view.points)
    assert uncertainty.rotation == pytest.approx(np.degrees(np.hypot(1e-3, 1e-3)))
    assert uncertainty.translation < 1e-2, "and a metre of lever makes of it a millimetre"


@pytest.mark.parametrize(
    ("values", "colour"),
    [
        ((0.99, 0.9, 0.9, 0.5), Grade.green),
        ((0.95, 0.34, 0.8, 0.1), Grade.green),
        ((0.949, 0.34, 0.8, 0.1), Grade.amber),
        ((0.95, 0.339, 0.8, 0.1), Grade.amber),
        ((0.95, 0.34, 0.799, 0.1), Grade.amber),
        ((0.95, 0.34, 0.8, 0.099), Grade.amber),
        ((0.5, 0.9, 0.9, 0.5), Grade.amber),
        ((0.499, 0.9, 0.9, 0.5), Grade.red),
        ((0.9, 0.9, 0.9, 0.5), Grade.amber),
        ((0.99, 0.2, 0.9, 0.5), Grade.amber),
        ((0.99, 0.9, 0.7, 0.5), Grade.amber),
        ((0.99, 0.9, 0.9, 0.05), Grade.amber),
        ((0.4, 0.9, 0.9, 0.5), Grade.red),
        ((None, 0.9, 0.9, 0.5), Grade.red),
        ((0.99, 0.9, None, 0.5), Grade.red),
    ],
)
def test_every_limit_of_the_grades_counts(values, colour):
    assert grade(*values) is colour


def test_pairs_that_are_apart_cost_no_query(monkeypatch):
    sampled = []
    view = blob_views()[0]
    views = [replace(view, name=str(k)) for k in range(30)]
    poses = {
        v.name: se3.from_parts(np.eye(3), np.array([1000.0 * k, 0, 0])) for k, v in enumerate(views)
    }
    monkeypatch.setattr("mvreg.geometry.nearest.nearest", lambda *a: sampled.append(a))
    assert contacts(poses, views) == []
    assert sampled == []


def test_a_sparse_scan_among_dense_ones_is_no_stranger():
    view = blob_views()[1]
    sparse = replace(view, points=view.points[::10], normals=view.normals[::10],
                     resolution=view.resolution * np.sqrt(10))  # fmt: skip
    scans = assess(result(), [blob_views()[0], sparse, blob_views()[2]]).scans
    assert scans["blob_1"].coverage > 0.6
    assert scans["blob_0"].coverage > 0.6


def test_the_frame_of_a_scan_turns_its_strength_only():
    turn = se3.from_parts(np.array([[0, 1.0, 0], [0, 0, 1], [1, 0, 0]]), np.zeros(3))
    views, poses = list(blob_views()), truth()
    before = assess(result(), views).scans["blob_1"]
    views[1] = moved_view(views[1], turn)
    poses["blob_1"] = poses["blob_1"] @ se3.invert(turn)
    after = assess(result(poses), views).scans["blob_1"]
    x, y, z = before.strength
    assert after.strength == pytest.approx((y, z, x), abs=1e-3)
    assert after.inlier_ratio == pytest.approx(before.inlier_ratio, abs=0.01)


def test_a_loop_that_holds_a_scan_raises_its_confidence():
    """Five to one: wrong pairs agree in a fifth."""
    assert in_a_loop(0.5) == pytest.approx(5 / 6)
    assert in_a_loop(0.0) == 0 and in_a_loop(1.0) == 1
    verdict = Verdict(True, 0.1, 0.05, "agrees", 0.97, {LOOP: 0.97})
    pair = Pair("a", "b", verdict, np.eye(4), 0.5, 0.0)
    assert in_loops([pair], ["a", "b", "c"]) == {"a", "b"}
    assert in_loops([pair], ["a", "c"]) == frozenset()  # of two partial models
    alone = replace(pair, verdict=replace(verdict, evidence={}))
    refused = replace(pair, verdict=replace(verdict, reliable=False))
    assert in_loops([alone, refused], ["a", "b"]) == frozenset()
