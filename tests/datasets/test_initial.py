"""Poses known beforehand: tried, or kept."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mvreg
from mvreg.datasets.initial import tell_initial
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.initial import in_their_frame
from mvreg.types import Result, Scan, ScanSet

RNG = np.random.default_rng(8)


def pose(shift=5.0, angle=1.0):
    rotation = Rotation.from_rotvec(angle * RNG.normal(size=3)).as_matrix()
    return se3.from_parts(rotation, shift * RNG.normal(size=3))


def write(path, poses):
    path.write_text(json.dumps({name: each.tolist() for name, each in poses.items()}))
    return str(path)


def worst(found, right):
    return max(
        np.linalg.norm(found[name][:3, 3] - right[name][:3, 3])
        + 100 * np.linalg.norm(found[name][:3, :3] - right[name][:3, :3])
        for name in right
    )


def test_that_the_others_come_into_the_frame_of_the_fixed_scans(tmp_path):
    frame = se3.from_parts(pose()[:3, :3], np.array([450_000.0, 5_400_000.0, 300.0]))
    plain = mvreg.dataset("tiny", scramble=True, rng=3)
    world = {name: frame @ each for name, each in plain.poses.items()}
    names = [scan.name for scan in plain.scans]
    for fixed in (names[2:3], names[1:4:2]):
        file = write(tmp_path / "known.json", {name: world[name] for name in fixed})
        scans = tell_initial(plain, file, fixed)
        result = mvreg.register(scans)
        assert len(result.poses) == 6
        for name in fixed:
            np.testing.assert_allclose(result.poses[name], world[name], rtol=1e-14, atol=1e-15)
            np.testing.assert_array_equal(result.covariances[name], np.zeros((6, 6)))
        assert worst(result.poses, world) < 1.0


def test_that_a_fixed_scan_without_a_pose_keeps_its_own_frame():
    scans = mvreg.dataset("tiny", fixed=["tiny_03"])
    result = mvreg.register(scans)
    np.testing.assert_array_equal(result.poses["tiny_03"], np.eye(4))


def test_that_fixed_scans_follow_a_scan_that_is_moved():
    scans = mvreg.dataset("tiny", fixed=["tiny_03", "tiny_00"], scramble=True, rng=4)
    assert [scan.name for scan in scans.scans if scan.fixed] == ["tiny_00", "tiny_03"]
    for scan in scans.scans:
        if scan.fixed:  # as read it is where it stays
            np.testing.assert_allclose(
                scan.initial @ scans.motions[scan.name], np.eye(4), atol=1e-9
            )
        else:
            assert scan.initial is None


def test_that_poses_known_beforehand_are_tried_where_nothing_else_is_found():
    plain = mvreg.dataset("tiny", scramble=True, rng=3)
    off = {name: each @ pose(0.3, 0.01) for name, each in plain.poses.items()}
    told = replace(
        plain, scans=tuple(replace(scan, initial=off[scan.name]) for scan in plain.scans)
    )
    blind = {"seed.top_fraction": 0.002}
    without, found = (mvreg.register(scans, changes=blind) for scans in (plain, told))
    assert len(without.poses) < 6
    assert len(found.poses) == 6
    frame = plain.poses[found.reference]
    right = {name: se3.invert(frame) @ each for name, each in plain.poses.items()}
    assert worst(found.poses, right) < 1.0


def test_that_wrong_poses_known_beforehand_are_not_believed():
    plain = mvreg.dataset("tiny", scramble=True, rng=3)
    wrong = tuple(replace(scan, initial=pose(20)) for scan in plain.scans)
    found = mvreg.register(replace(plain, scans=wrong))
    frame = plain.poses[found.reference]
    right = {name: se3.invert(frame) @ plain.poses[name] for name in found.poses}
    assert len(found.poses) == 6
    assert worst(found.poses, right) < 1.0


def test_that_covariances_turn_with_the_frame():
    motion, here, twist = pose(), pose(), 1e-6 * RNG.normal(size=6)
    np.testing.assert_allclose(
        motion @ se3.exp(twist) @ here,
        se3.exp(se3.adjoint(motion) @ twist) @ motion @ here,
        atol=1e-10,
    )
    scan = Scan("a", np.zeros((1, 3)), initial=motion, fixed=True)
    half = RNG.normal(size=(6, 6))
    result = Result("a", {"a": np.eye(4), "b": here}, (), (), covariances={"b": half @ half.T})
    moved = in_their_frame(result, [scan])
    np.testing.assert_array_equal(moved.poses["a"], motion)
    np.testing.assert_allclose(moved.poses["b"], motion @ here)
    np.testing.assert_allclose(
        moved.covariances["b"], se3.adjoint(motion) @ half @ half.T @ se3.adjoint(motion).T
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"strategy": "grow"},
            "GrowStrategy cannot hold several scans.*strategy=best",
        ),
        ({"adjust": "motion_averaging"}, "cannot hold several scans; fix one, or use adjust=joint"),
    ],
)
def test_that_stages_that_cannot_hold_several_scans_are_named(change, said):
    scans = mvreg.dataset("tiny", fixed=["tiny_03", "tiny_00"])
    with pytest.raises(InputError, match=said):
        mvreg.register(scans, changes=change)


def test_that_few_decimals_are_told(tmp_path):
    scans = ScanSet("s", (Scan("a.ply", np.zeros((1, 3))),))
    exact = pose()
    told = tell_initial(scans, write(tmp_path / "known.json", {"a.ply": exact.round(2)}), [])
    (remark,) = told.remarks
    assert "1 of 1 poses (a.ply) are no exact rotations" in remark
    np.testing.assert_allclose(told.scans[0].initial, exact, atol=0.011)


def test_that_what_fits_no_scan_is_told(tmp_path):
    scans = ScanSet("s", (Scan("a.ply", np.zeros((1, 3))),))
    with pytest.raises(InputError, match=r"dataset.fixed=\['b'\]: .* a.ply; got b"):
        tell_initial(scans, "", ["b"])
    file = write(tmp_path / "known.json", {"c.ply": np.eye(4)})
    with pytest.raises(InputError, match=r"expected poses of the scans a.ply; got poses of c.ply"):
        tell_initial(scans, file, [])
    with pytest.raises(InputError, match="scans with poses in their files, found none"):
        tell_initial(scans, "file", [])


def test_that_poses_go_by_names_without_the_ending_and_others_are_told(tmp_path):
    plain = mvreg.dataset("tiny")
    named = replace(plain, scans=tuple(replace(s, name=f"{s.name}.ply") for s in plain.scans))
    known = {"tiny_01": pose(), "tiny_02.txt": pose(), "elsewhere.ply": pose()}
    told = tell_initial(named, write(tmp_path / "known.json", known), [])
    by_name = {scan.name: scan.initial for scan in told.scans}
    np.testing.assert_allclose(by_name["tiny_01.ply"], known["tiny_01"], atol=1e-12)
    np.testing.assert_allclose(by_name["tiny_02.ply"], known["tiny_02.txt"], atol=1e-12)
    assert sum(each is None for each in by_name.values()) == 4
    assert told.remarks[-1] == "known.json: 1 pose is of no scan that is here: elsewhere.ply"
