"""Rooms, desks and yards by the default method: placed rightly, or not at all."""

from functools import cache

import numpy as np
import pytest

import mvreg
from mvreg.geometry import se3

#: What is right: degrees, metres. Neighbouring hypotheses are half a turn or a metre off.
ANGLE, SHIFT = 3.0, 0.3


@cache
def placed(name, sensor, variant=0):
    scans = mvreg.dataset(
        name, rng=1, sensor=sensor, variant=variant, scramble=True, order="shuffle"
    )
    return scans, mvreg.register(scans)


def wrong(scans, poses):
    """The scans that are not where the truth has them, beside the reference."""
    reference = next(iter(poses))
    found = []
    for name, pose in poses.items():
        error = se3.invert(se3.invert(scans.poses[reference]) @ scans.poses[name]) @ pose
        if (
            np.rad2deg(se3.rotation_angle(error, np.eye(4))) > ANGLE
            or np.linalg.norm(error[:3, 3]) > SHIFT
        ):
            found.append(name)
    return found


@pytest.mark.parametrize("sensor", ["auto", "unknown"])
@pytest.mark.parametrize("name", ["room", "desk"])
def test_every_scan_of_a_place_is_placed(name, sensor):
    scans, result = placed(name, sensor)
    assert len(result.poses) == len(scans.scans)
    assert wrong(scans, result.poses) == []
    assert len(result.pairs) <= 2.5 * len(scans.scans)


def test_a_symmetric_yard_is_ambiguous_never_wrong():
    scans, result = placed("yard", "unknown")
    for poses in (result.poses, *result.components):
        assert wrong(scans, poses) == []
    assert any("ambiguous" in pair.verdict.reason for pair in result.pairs)


def test_two_rooms_of_one_kind_stay_apart():
    both = [placed("room", "unknown", variant) for variant in (1, 2)]
    scans = [scan for scans, _ in both for scan in scans.scans]
    result = mvreg.register(scans, rng=1)
    of = {scan.name: k for k, (one, _) in enumerate(both) for scan in one.scans}
    for poses in (result.poses, *result.components):
        assert len({of[name] for name in poses}) == 1


@pytest.mark.parametrize("shape", ["box", "plate"])
def test_symmetric_things_are_ambiguous_never_wrong(shape):
    """A pose that can slide is a rival of one that cannot: the right one may be of either kind."""
    scans = mvreg.dataset("figurine", shape=shape, rng=0, scramble=True, order="shuffle")
    result = mvreg.register(scans)
    assert len(result.poses) == 1 and not result.components
