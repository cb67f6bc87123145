"""Who tells where the sensors were, and what then is known of every scan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import mvreg
from mvreg.datasets.base import ScanSource
from mvreg.datasets.folder import Folder
from mvreg.datasets.sensors import DIRECTIONS
from mvreg.errors import InputError, RecordError
from mvreg.geometry import se3
from mvreg.types import Scan, ScanSet

PCD = (
    "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\n"
    "VIEWPOINT {}\nPOINTS 3\nDATA ascii\n1 2 3\n4 5 6\n7 8 10\n"
)


@pytest.fixture
def scans(tmp_path: Path) -> str:
    """A file that tells its sensor, one with the default, one whose format has no room for it."""
    (tmp_path / "a.pcd").write_text(PCD.format("5 6 7 1 0 0 0"))
    (tmp_path / "b.pcd").write_text(PCD.format("0 0 0 1 0 0 0"))
    (tmp_path / "c.xyz").write_text("1 2 3\n4 5 6\n7 8 10\n")
    return str(tmp_path)


def told(found: ScanSet) -> list[str]:
    return [found.sensor_of(scan) for scan in found.scans]


def test_a_folder_knows_what_its_files_say(scans: str, rng: np.random.Generator) -> None:
    found = Folder(path=scans)(rng)
    assert told(found) == ["file", "unknown", "unknown"]
    np.testing.assert_array_equal(found.scans[0].view_point, [5, 6, 7])
    assert not any(scan.knows_sensor for scan in found.scans[1:])


def test_the_user_may_say_that_nothing_is_known(scans: str, rng: np.random.Generator) -> None:
    found = Folder(path=scans, sensor="unknown")(rng)
    assert told(found) == ["unknown"] * 3
    assert not any(scan.knows_sensor for scan in found.scans)


def test_the_user_is_believed_before_the_file(scans: str, rng: np.random.Generator) -> None:
    found = Folder(path=scans, sensor="origin")(rng)
    assert told(found) == ["user"] * 3
    for scan in found.scans:
        np.testing.assert_array_equal(scan.view_point, np.zeros(3))
        assert scan.view_direction is None
    for name, direction in DIRECTIONS.items():
        found = Folder(path=scans, sensor=name)(rng)
        assert told(found) == ["user"] * 3
        for scan in found.scans:
            np.testing.assert_array_equal(scan.view_direction, direction)
            assert scan.view_point is None
    assert DIRECTIONS["-y"] == (0, -1, 0)


@pytest.mark.parametrize("sensor", ["origin", "+x"])
def test_what_the_user_says_is_of_the_files_frames_and_moves_with_them(
    scans: str, sensor: str
) -> None:
    found = Folder(path=scans, sensor=sensor, scramble=True)(np.random.default_rng(3))
    assert told(found) == ["user"] * 3
    for scan in found.scans:
        motion = found.motions[scan.name]
        assert se3.rotation_angle(motion, np.eye(4)) > 0.05
        if sensor == "origin":
            np.testing.assert_allclose(scan.view_point, motion[:3, 3])
        else:
            np.testing.assert_allclose(scan.view_direction, motion[:3, 0])


def test_what_is_no_sensor_lists_the_options() -> None:
    expected = (
        r"dataset\.sensor=foo: expected one of auto, unknown, origin, \+x, -x, \+y, -y, \+z, -z"
    )
    with pytest.raises(InputError, match=expected):
        Folder(path="x", sensor="foo")
    with pytest.raises(InputError, match=expected):
        mvreg.dataset("tiny", sensor="foo")


@pytest.mark.parametrize("sensor", ["unknown", "+z", "-x"])
def test_every_data_set_can_be_told_and_so_can_its_copies(sensor: str) -> None:
    plain = mvreg.dataset("tiny", views=2)
    assert told(plain) == ["data set"] * 2
    given = {"order": "shuffle", "scramble": True}
    bare = mvreg.dataset("tiny", views=2, sensor=sensor, **given)
    before = mvreg.dataset("tiny", views=2, **given)
    expected = "unknown" if sensor == "unknown" else "user"
    assert told(bare) == [expected] * 2
    for old, new in zip(before.scans, bare.scans, strict=True):
        assert old.name == new.name
        np.testing.assert_array_equal(old.points, new.points)
    mixed = mvreg.dataset("mixture", of=[f"tiny views=3 sensor={sensor}"], keep=["2"])
    assert told(mixed) == [expected] * 2
    assert set(mixed.sensors) <= {scan.name for scan in mixed.scans}
    assert told(mvreg.dataset("spoilt", of=f"tiny views=2 sensor={sensor}")) == [expected] * 2
    assert told(mvreg.dataset("spoilt", of="tiny views=2", sensor=sensor)) == [expected] * 2


def test_a_library_call_takes_the_signs(scans: str) -> None:
    found = mvreg.dataset("folder", path=scans, sensor="-z")
    np.testing.assert_array_equal(found.scans[0].view_direction, [0, 0, -1])


def test_a_source_of_one_s_own_is_told_as_well(rng: np.random.Generator) -> None:
    class Own(ScanSource):
        def load(self, rng: np.random.Generator) -> ScanSet:
            return ScanSet("own", (Scan("a", np.eye(3), view_direction=np.ones(3)),))

    assert told(Own()(rng)) == ["data set"]
    (scan,) = Own(sensor="origin")(rng).scans
    assert scan.view_direction is None


@pytest.mark.parametrize(("field", "wrong"), [("sensors", ["a"]), ("remarks", "words")])
def test_what_a_set_says_of_its_scans_is_checked(field: str, wrong: object) -> None:
    with pytest.raises(RecordError, match=rf"ScanSet\.{field}"):
        ScanSet("toy", (), **{field: wrong})  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["room", "office", "yard", "street"])
def test_levelled_scanners_are_upright(name: str) -> None:
    """The verticals that are told are those of the true poses; a car sways by a few degrees."""
    found = mvreg.dataset(name, scans=3, rays=600, upright=True, scramble=True)
    assert found.poses is not None
    for scan in found.scans:
        assert scan.up is not None
        up = found.poses[scan.name][:3, :3] @ scan.up
        assert np.degrees(np.arccos(min(up[2], 1.0))) < (4.0 if name == "street" else 1e-4)
    assert all(scan.up is None for scan in mvreg.dataset(name, scans=2, rays=600).scans)
