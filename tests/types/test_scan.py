import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.types import Scan


@pytest.mark.parametrize("known", ["view_direction", "view_point"])
def test_points_and_sensor_move_together(rng, known):
    points, sensor = rng.normal(size=(9, 3)), np.array([0.0, 3.0, 4.0])
    motion = se3.random(rng, 5.0)
    found = Scan("one", points, **{known: sensor}).moved(motion)
    np.testing.assert_allclose(found.points, se3.apply(motion, points))
    expected = motion[:3, :3] @ sensor / 5 if known == "view_direction" else (
        se3.apply(motion, sensor)
    )  # fmt: skip
    np.testing.assert_allclose(getattr(found, known), expected)
    assert found.knows_sensor and found.name == "one"


def test_a_scan_of_an_unknown_sensor_stays_one_when_moved(rng):
    found = Scan("one", rng.normal(size=(9, 3))).moved(se3.random(rng, 5.0))
    assert not found.knows_sensor


@pytest.mark.parametrize(
    ("sensor", "said"),
    [
        ({"view_direction": (0.0, 0.0, 0.0)}, "view_direction is the zero vector"),
        ({"view_direction": (0.0, 1.0)}, "expected view_direction of 3 numbers"),
        ({"view_direction": (0.0, np.nan, 1.0)}, "expected view_direction of 3 numbers"),
        ({"up": (0.0, 0.0, 0.0)}, "up is the zero vector"),
        ({"up": (0.0, 1.0)}, "expected up of 3 numbers"),
        ({"view_point": np.eye(3)}, "expected view_point of 3 numbers"),
        ({"view_point": (np.inf, 0.0, 1.0)}, "expected view_point of 3 numbers"),
    ],
)
def test_a_sensor_that_is_nowhere_is_refused(sensor, said):
    with pytest.raises(InputError, match=f"scan 'one': {said}"):
        Scan("one", np.zeros((1, 3)), **sensor)


def test_the_vertical_turns_with_the_points(rng):
    motion = se3.random(rng, 5.0)
    scan = Scan("one", rng.normal(size=(9, 3)), up=(0.0, 0.0, 2.0))
    np.testing.assert_array_equal(scan.up, [0, 0, 1])
    np.testing.assert_allclose(scan.moved(motion).up, motion[:3, 2])
    assert Scan("one", scan.points).moved(motion).up is None and not scan.knows_sensor
