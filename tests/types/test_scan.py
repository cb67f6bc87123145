import numpy as np
import pytest

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
