"""Records refuse what cannot be right, take what can be, and convert what loses nothing."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.errors import InputError, RecordError
from mvreg.geometry import se3
from mvreg.testing import overlap
from mvreg.testing.views import registration
from mvreg.types import (
    Candidates,
    Edge,
    Features,
    Link,
    Matches,
    Model,
    Pair,
    Part,
    Result,
    Sample,
    Scale,
    Verdict,
    View,
    checks,
)

POSE = se3.random(np.random.default_rng(3), 50.0)


def drifted(by: float) -> np.ndarray:
    """A pose whose rotation is stretched along an axis, so that R^T R is about `by` off."""
    return POSE @ np.diag([1 + by / 2, 1, 1, 1])


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_poses_are_rigid_to_a_millionth_in_any_unit(unit):
    there = se3.from_parts(POSE[:3, :3], POSE[:3, 3] * unit)
    assert checks.pose("pose", there) is there
    for by, fits in ((1e-12, True), (9e-7, True), (1.2e-6, False), (-1.2e-6, False)):
        pose = drifted(by)
        pose[:3, 3] *= unit
        if fits:
            assert checks.pose("pose", pose) is pose
        else:
            with pytest.raises(RecordError, match=r"pose: expected a rigid motion.* 1.2e-06 from"):
                checks.pose("pose", pose)


def changed(row, column, value):
    pose = POSE.copy()
    pose[row, column] = value
    return pose


@pytest.mark.parametrize(
    ("pose", "said"),
    [
        (changed(0, 1, np.nan), r"finite numbers, got nan at \(0, 1\)"),
        (changed(1, 3, np.inf), r"finite numbers, got inf at \(1, 3\)"),
        (changed(2, 3, -np.inf), r"finite numbers, got -inf at \(2, 3\)"),
        (changed(3, 3, 2.0), r"expected the last row \(0, 0, 0, 1\), got \(0\.0, 0\.0, 0\.0, 2\.0"),
        (changed(3, 0, np.nan), r"last row \(0, 0, 0, 1\), got \(nan, 0\.0, 0\.0, 1\.0"),
        (POSE @ np.diag([1.0, -1.0, 1.0, 1.0]), "got a reflection"),
        (np.zeros((4, 4)), "expected a rigid motion"),
        (POSE[:3], r"expected shape \(4, 4\), got \(3, 4\)"),
        (POSE + 0j, "real numbers, got an array .4, 4. of complex128"),
        ("pose", "real numbers, got str 'pose'"),
        ([[1, 2], [3]], "an array of real numbers"),
        (None, "real numbers, got None"),
    ],
)
def test_what_is_no_pose_is_refused_wherever_a_record_has_one(pose, said):
    view, verdict = overlap().source, Verdict(True, 0.0, 1.0, "")
    for make in (
        lambda: Edge("a", "b", pose),
        lambda: Part(view, pose),
        lambda: Result("a", {"a": np.eye(4), "b": pose}, (), ()),
        lambda: Result("a", {"a": np.eye(4)}, (), (), components=({"b": pose},)),
        lambda: replace(registration(view, view, np.eye(4)), T_target_source=pose),
    ):
        with pytest.raises(RecordError, match=said):
            make()
    if pose is not None:
        with pytest.raises(RecordError, match=f"Pair.T_target_source: .*{said}"):
            Pair("a", "b", verdict, pose)


def test_arrays_that_lose_nothing_are_converted_and_others_are_shared():
    indices, distances = np.array([[0, 1]]), np.array([0.5])
    same = Matches(indices, distances)
    assert same.indices is indices and same.distances is distances
    made = Matches([[0, 1]], [1])
    assert made.indices.dtype == np.intp and made.distances.dtype == np.float64
    single = Edge("a", "b", POSE.astype(np.float32)).T_target_source
    assert single.dtype == np.float64
    points = overlap().source.points[::3]
    assert Sample(points, points).points is points, "not even strided ones are copied"
    verdict = Verdict(np.bool_(True), np.float64(1), 2, "")
    assert verdict.reliable is True


def test_what_is_empty_or_infinite_and_means_something_is_taken():
    assert len(Matches.none()) == len(Candidates.none()) == 0
    Matches(np.empty((0, 2)), [])
    Verdict(False, float("inf"), 0.0, "no candidate pose")
    Pair("a", "b", Verdict(False, float("inf"), 0.0, ""))
    Features(np.empty((0, 3)), np.empty((0, 1, 3)), np.empty((0, 1)), oriented=False)
    nothing = np.empty((0, 3))
    features = overlap().source.features
    View("", nothing, nothing, features, 0.0, Scale(1.0, 0.0))
    Result("", {"": np.eye(4)}, (), ())
    Link("a", "b", 0, 0.0)


F = overlap().source.features
UP = np.tile([0.0, 0.0, 1.0], (2, 1, 1))
REFUSED = {
    "negative index": (lambda: Matches([[0, -1]], [0.5]), "Matches.indices: .* got -1"),
    "fractions": (lambda: Matches([[0, 0.5]], [0.5]), "whole numbers"),
    "one axis": (lambda: Matches(np.arange(4), np.zeros(4)), r"\(M, 2\), got \(4,\)"),
    "one distance": (lambda: Matches([[0, 1]], [0.5, 0.5]), r"shape \(1\), got \(2,\)"),
    "NaN distance": (lambda: Matches([[0, 1]], [np.nan]), r"got nan at \(0,\)"),
    "matches missing": (lambda: Candidates(POSE[None], [0.0], ()), "one per pose, got 0"),
    "matches in an array": (
        lambda: Candidates(POSE[None], [0.0], np.zeros((1, 0, 2))),
        "Candidates.matches: expected tuple",
    ),
    "second of two poses": (
        lambda: Candidates(np.stack([POSE, 2 * POSE]), [0.0, 1.0], ((), ())),
        r"Candidates.poses\[1\]: expected a rigid",
    ),
    "zero normal": (lambda: Features(UP[:, 0], 0 * UP, UP[:, 0], True), "one of length 0 at"),
    "NaN normal": (lambda: Features(UP[:, 0], np.nan * UP, UP[:, 0], True), "got nan"),
    "fewer descriptors": (lambda: Features(UP[:, 0], UP, UP[:1, 0], True), r"\(2, D\)"),
    "oriented unsaid": (lambda: replace(F, oriented=None), "True or False, got None"),
    "points in the plane": (lambda: Sample(np.zeros((4, 2)), np.zeros((0, 3))), r"\(N, 3\)"),
    "fewer normals": (
        lambda: replace(overlap().source, normals=overlap().source.normals[1:]),
        "View.normals: expected shape",
    ),
    "normals of a model": (
        lambda: replace(Model.of(overlap().source), points=np.zeros((1, 3))),
        r"Model.normals: expected shape \(1, 3\)",
    ),
    "NaN point": (lambda: replace(overlap().source, points=[[0, 0, np.nan]]), "View.points: .*nan"),
    "features missing": (lambda: replace(overlap().source, features=None), "Features, got None"),
    "negative resolution": (lambda: Scale(1.0, -1.0), "Scale.resolution: .* got float -1.0"),
    "infinite spacing": (lambda: Scale(np.inf, 1.0), "Scale.spacing: .* got float inf"),
    "overlap in per cent": (lambda: Edge("a", "b", POSE, 80.0), "Edge.overlap: .* float 80.0"),
    "verdict of 1": (lambda: Verdict(1, 0.0, 1.0, ""), "reliable: .*, got int 1"),
    "confidence of -1": (lambda: Verdict(True, 0, 1, "", -1.0), "confidence: .* float -1.0"),
    "no score": (lambda: Verdict(True, None, 1.0, ""), "Verdict.score: .* got None"),
    "pair without verdict": (lambda: Pair("a", "b", True), "Pair.verdict: expected Verdict"),
    "name of bytes": (lambda: Pair(b"a", "b", None), "Pair.source: expected a text"),
    "no pose of the reference": (
        lambda: Result("a", {"b": POSE}, (), ()),
        "a pose of the reference 'a', got poses of 'b'",
    ),
    "a list of names": (lambda: Result("a", {"a": POSE}, [], ()), "unregistered: expected tuple"),
    "poses in a list": (lambda: Result("a", [POSE], (), ()), "Result.poses: expected a mapping"),
    "covariance (3, 3)": (
        lambda: Result("a", {"a": POSE}, (), (), covariances={"a": np.eye(3)}),
        r"Result.covariances\['a'\]: expected shape \(6, 6\)",
    ),
    "link of NaN": (lambda: Link("a", "b", 3, np.nan), "Link.rms: .* got float nan"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_right_is_refused(name):
    make, said = REFUSED[name]
    with pytest.raises(RecordError, match=said):
        make()


def test_a_record_s_error_is_wrong_input_for_who_makes_it():
    with pytest.raises(InputError):
        Scale(np.nan, 1.0)
