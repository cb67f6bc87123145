"""Poses: the Stanford convention, JSON, and what is no pose."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.io import read_points, read_poses
from mvreg.io.poses import read_poses_and_remarks


def write(path: Path, content: object) -> Path:
    path.write_text(content if isinstance(content, str) else json.dumps(content), "utf-8")
    return path


def test_the_conf_convention(tmp_path: Path) -> None:
    # The quaternion turns by +90 degrees about z: the pose turns back, x onto -y.
    half = np.sqrt(0.5)
    text = (
        "camera 0 0 0 0 0 0 1\nmesh a_cybcyl 9 9 9 0 0 0 1\n\n"
        f"bmesh scans/a b.ply 1 2 3 0 0 {half} {half}\nbmesh c.ply 0 0 0 0 0 0 -1\n"
    )
    poses = read_poses(write(tmp_path / "a.CONF", text))
    assert list(poses) == ["a b.ply", "c.ply"]
    np.testing.assert_allclose(se3.apply(poses["a b.ply"], np.array([[1.0, 0, 0]])), [[1, 1, 3]])
    np.testing.assert_allclose(poses["c.ply"], np.eye(4), atol=1e-12)


@pytest.mark.parametrize(
    ("folder", "conf", "first", "second"),
    [
        ("bunny/data", "bun.conf", "bun000.ply", "bun045.ply"),
        ("bunny/data", "bun.conf", "top2.ply", "top3.ply"),
        ("dragon_stand", "dragonStandRight.conf", "dragonStandRight_0.ply",
         "dragonStandRight_24.ply"),
        ("happy_stand", "happyStandRight.conf", "happyStandRight_0.ply", "happyStandRight_336.ply"),
        ("armadillo_partial", "ArmadilloBack.conf", "ArmadilloBack_0.ply", "ArmadilloBack_330.ply"),
    ],
)  # fmt: skip
def test_real_poses_bring_real_scans_together(
    data_root: Path, folder: str, conf: str, first: str, second: str
) -> None:
    poses = read_poses(data_root / folder / conf)
    source, target = (
        se3.apply(poses[name], read_points(data_root / folder / name)) for name in (first, second)
    )
    distances, _ = cKDTree(target).query(source[::20])
    # A third of one scan or more lies on the other: within half a millimetre, in metres.
    assert np.quantile(distances, 0.33) < 0.0005


def test_json_poses(tmp_path: Path, rng: np.random.Generator) -> None:
    poses = {"a.ply": se3.random(rng, 5), "b.ply": se3.random(rng, 5)}
    nested = {"unit": "mm", "poses": {name: pose.tolist() for name, pose in poses.items()}}
    flat = {name: pose.ravel().tolist() for name, pose in poses.items()}
    rounded = {name: pose.round(4).tolist() for name, pose in poses.items()}
    for content, tolerance in ((nested, 1e-12), (nested["poses"], 1e-12), (flat, 1e-12),
                               (rounded, 1e-3)):  # fmt: skip
        read = read_poses(write(tmp_path / "a.json", content))
        assert list(read) == list(poses)
        for name, pose in poses.items():
            np.testing.assert_allclose(read[name], pose, atol=tolerance)
            rotation = read[name][:3, :3]
            np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)


def test_that_two_decimals_are_enough_and_are_told(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    exact = {f"{k}.ply": se3.random(rng, 5) for k in range(300)}
    content = {name: pose.round(2).tolist() for name, pose in exact.items()}
    read, remarks = read_poses_and_remarks(write(tmp_path / "a.json", content))
    for name, pose in exact.items():
        rotation = read[name][:3, :3]
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(rotation, pose[:3, :3], atol=0.011)
    worst = max(np.abs(read[name] - content[name]).max() for name in exact)
    assert 0.005 < worst < 0.009
    (remark,) = remarks
    assert remark.startswith("a.json: the matrices of 300 of 300 poses (0.ply, 1.ply, ")
    assert f"differ by up to {worst:.2g} in an entry" in remark


def test_that_poses_of_many_digits_are_not_mentioned(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    content = {"a": se3.random(rng, 5).round(6).tolist(), "b": EYE}
    assert read_poses_and_remarks(write(tmp_path / "a.json", content))[1] == ()


def test_that_small_scales_are_not_taken_for_rounding(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    for factor in (0.98, 0.99, 1.01, 1.02):
        pose = se3.random(rng, 5)
        pose[:3, :3] *= factor
        with pytest.raises(InputError, match="scales, shears or mirrors"):
            read_poses(write(tmp_path / "a.json", {"a": pose.tolist()}))


SCALED = np.diag([2.0, 2, 2, 1]).tolist()
MIRRORED = np.diag([1.0, 1, -1, 1]).tolist()
EYE = np.eye(4).tolist()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.json", "{", "not a JSON file"),
        ("a.json", "[" * 100_000, "not a JSON file"),
        ("a.json", [EYE], "expected an object"),
        ("a.json", {}, "at least one pose"),
        ("a.json", {"poses": {}}, "at least one pose"),
        ("a.json", {"a": [[1, 0], [0, 1]]}, "'a': expected 4x4 numbers"),
        ("a.json", {"a": "x"}, "expected 4x4 numbers"),
        ("a.json", {"a": [[10**400] * 4] * 4}, "expected 4x4 numbers"),
        ("a.json", {"a": None}, "expected 4x4 numbers"),
        ("a.json", {"a": SCALED}, "scales, shears or mirrors"),
        ("a.json", {"a": MIRRORED}, "scales, shears or mirrors"),
        ("a.json", {"a": [[1e300] * 4] * 3 + [[0, 0, 0, 1]]}, "scales, shears or mirrors"),
        ("a.json", {"a": np.ones((4, 4)).tolist()}, "last row 0 0 0 1"),
        ("a.json", {"a": [[float("nan")] * 4] * 4}, "finite"),
        ("a.json", {"x/a": EYE, "a": EYE}, "second pose for 'a'"),
        ("a.conf", "", "at least one pose"),
        ("a.conf", "camera 0\nmesh a 0 0 0 0 0 0 1\n", "at least one pose"),
        ("a.conf", "bmesh a.ply 0 0 0 0 0 0\n", "line 1: expected 'bmesh FILE"),
        ("a.conf", "\nbmesh a.ply 0 0 x 0 0 0 1\n", "line 2: expected 'bmesh FILE"),
        ("a.conf", "bmesh a.ply 0 0 0 0 0 0 0\n", "length 1, got length 0"),
        ("a.conf", "bmesh a.ply 0 0 0 0 0 nan 1\n", "length 1, got length nan"),
        ("a.conf", "bmesh a.ply 0 0 inf 0 0 0 1\n", "finite"),
        ("a.conf", "bmesh a 0 0 0 0 0 0 1\nbmesh a 0 0 0 0 0 0 1\n", "line 2: a second pose"),
        ("a.txt", "", "ending in .conf or .json"),
    ],
)
def test_what_is_no_pose_is_named(tmp_path: Path, name: str, content: object, message: str) -> None:
    path = write(tmp_path / name, content)
    with pytest.raises(InputError, match=message) as caught:
        read_poses(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("name", ["missing.conf", "folder.json"])
def test_unreadable_files_are_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        read_poses(tmp_path / name)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.binary(max_size=200), st.sampled_from([".conf", ".json"]))
def test_garbage_is_refused(tmp_path: Path, content: bytes, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError):
        read_poses(path)
