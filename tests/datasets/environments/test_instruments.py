"""Virtual instruments: where their rays go, and what they get wrong."""

import numpy as np
import pytest

from mvreg.datasets.environments.build import at, between, box
from mvreg.datasets.environments.effects import RangeError, mix, survivors
from mvreg.datasets.environments.instruments import DepthCamera, Instrument, Panorama, RotatingLidar
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.viewpoints import look_at
from mvreg.errors import InputError

#: A hall, 10 by 10 by 4 m, with a block in it.
HALL = Scene((
    between((-6, -6, -1), (6, 6, 0)), between((-6, -6, 4), (6, 6, 5)),
    between((5, -6, 0), (6, 6, 4)), between((-6, -6, 0), (-5, 6, 4)),
    between((-6, 5, 0), (6, 6, 4)), between((-6, -6, 0), (6, -5, 4)), box((1, 1, 2), (2, 2, 0)),
))  # fmt: skip
POSE = at(0, 0, 1.6, turn=50)
PERFECT = {"noise": 0, "grazing": 90}


def rng():
    return np.random.default_rng(7)


def angles(points):
    ranges = np.linalg.norm(points, axis=1)
    elevations = np.degrees(np.arcsin(points[:, 2] / ranges))
    return np.degrees(np.arctan2(points[:, 1], points[:, 0])), elevations


def test_a_panorama_is_all_around_but_for_the_cone_below():
    points = Panorama(10_000, **PERFECT, lowest=-60, highest=85)(HALL, POSE, rng())
    azimuths, elevations = angles(points)
    assert len(points) == pytest.approx(10_000, rel=0.03)
    assert elevations.min() == pytest.approx(-60) and 82 < elevations.max() < 85
    step = np.diff(np.unique(azimuths.round(6)))
    assert step == pytest.approx(np.sqrt(360 * 145 / 10_000), rel=0.02)


def test_a_lidar_has_its_beams():
    points = RotatingLidar(32 * 900, **PERFECT)(HALL, POSE, rng())
    azimuths, elevations = angles(points)
    assert np.unique(elevations.round(6)) == pytest.approx(np.linspace(-25, 15, 32), abs=1e-5)
    assert len(np.unique(azimuths.round(6))) == pytest.approx(900, abs=1)


def test_a_depth_camera_sees_its_field_and_nothing_behind_it():
    pose = look_at(np.array([0.0, 0, 1.5]), np.array([4.0, 1, 1]))
    points = DepthCamera(19_200, **PERFECT)(HALL, pose, rng())
    assert len(points) == 160 * 120
    x, y = np.abs(points[:, :2] / -points[:, 2:]).max(axis=0)
    assert x == pytest.approx(np.tan(np.radians(30)) * 159 / 160)
    assert y == pytest.approx(x * 119 / 159)
    assert (points[:, 2] < 0).all()


@pytest.mark.parametrize("instrument", [Panorama, RotatingLidar, DepthCamera])
def test_without_errors_points_are_on_surfaces_and_the_way_to_them_is_free(instrument):
    points = instrument(3000, **PERFECT)(HALL, POSE, rng())
    world = points @ POSE[:3, :3].T + POSE[:3, 3]
    assert np.abs(HALL.clearance(world)).max() < 1e-9
    for share in (0.3, 0.7, 0.99):
        assert (HALL.clearance(POSE[:3, 3] + share * (world - POSE[:3, 3])) > 0).all()


@pytest.mark.parametrize("instrument", [Panorama, RotatingLidar, DepthCamera])
def test_errors_are_along_the_rays(instrument):
    settings = {"error": RangeError(constant=0.02, disparity=0.001), "grazing": 90}
    exact = instrument(3000, noise=0, **settings)(HALL, POSE, rng())
    noisy = instrument(3000, noise=1, **settings)(HALL, POSE, rng())
    assert not np.allclose(exact, noisy, atol=0.005)
    rays = [points / np.linalg.norm(points, axis=1, keepdims=True) for points in (exact, noisy)]
    assert np.allclose(*rays)


def test_errors_of_range_have_their_size():
    ranges = np.repeat([1.0, 4.0], 50_000)
    error = RangeError(constant=0.001, linear=0.002, quadratic=0.003)
    off = (error(ranges, 2.0, rng()) - ranges).reshape(2, -1)
    assert off.std(axis=1) == pytest.approx([0.012, 0.114], rel=0.02)
    assert np.abs(off.mean(axis=1)) == pytest.approx([0, 0], abs=0.002)
    assert np.array_equal(error(ranges, 0.0, rng()), ranges)


def test_ranges_and_disparities_are_rounded():
    ranges = np.linspace(0.5, 5, 1000)
    stepped = RangeError(step=0.05)(ranges, 1.0, rng())
    assert np.allclose(stepped / 0.05, np.round(stepped / 0.05))
    assert np.abs(stepped - ranges).max() <= 0.025 + 1e-9
    stereo = RangeError(disparity=0.003)(ranges, 1.0, rng())
    assert np.allclose(1 / stereo / 0.003, np.round(1 / stereo / 0.003))
    off = np.abs(stereo - ranges)
    assert off[-200:].max() > 20 * off[:100].max()  # it grows with the square of the range
    for error in (RangeError(step=0.05), RangeError(disparity=0.003)):
        assert np.array_equal(error(ranges, 0.0, rng()), ranges)


def test_pixels_are_mixed_at_edges_only_and_lie_between_both_surfaces():
    picture = np.full((60, 80), 2.0)
    picture[:, 40:] = 5.0
    picture[:10] = np.inf
    mixed = mix(picture, 0.01, 1.0, False, rng())
    changed = mixed != picture
    columns = np.flatnonzero(changed.any(axis=0))
    assert columns.tolist() == [39, 40]
    assert not changed[:10].any() and np.isinf(mixed[:10]).all()
    assert ((mixed[changed] > 2) & (mixed[changed] < 5)).all() and np.ptp(mixed[changed]) > 2
    half = mix(picture, 0.01, 0.5, False, rng()) != picture
    assert 0.3 < half.sum() / changed.sum() < 0.7
    assert np.array_equal(mix(picture, 0.01, 0.0, False, rng()), picture)
    around = mix(picture, 0.01, 1.0, True, rng()) != picture
    assert np.flatnonzero(around.any(axis=0)).tolist() == [0, 39, 40, 79]


def test_mixed_pixels_grow_with_their_share():
    def off_surface(mixed):
        points = Panorama(8000, mixed=mixed, **PERFECT)(HALL, POSE, rng())
        world = points @ POSE[:3, :3].T + POSE[:3, 3]
        return (np.abs(HALL.clearance(world)) > 0.01).mean()

    shares = [off_surface(mixed) for mixed in (0, 0.2, 0.5, 1.0)]
    assert shares[0] == 0 < shares[1] < shares[2] < shares[3] < 0.1


def test_points_are_lost_at_random():
    counts = [
        len(Panorama(8000, lost=lost, **PERFECT)(HALL, POSE, rng())) for lost in (0, 0.1, 0.6)
    ]
    assert counts[1] / counts[0] == pytest.approx(0.9, abs=0.02)
    assert counts[2] / counts[0] == pytest.approx(0.4, abs=0.02)


def test_points_are_lost_at_grazing_angles():
    incidence = np.linspace(0, 89.99, 100_000)[None]
    kept = survivors(np.ones_like(incidence), np.cos(np.radians(incidence)), 0.0, 80.0, rng())
    assert kept[incidence <= 80].all()
    for low, high, share in ((80, 82, 0.9), (84, 86, 0.5), (88, 90, 0.1)):
        chosen = (incidence > low) & (incidence < high)
        assert kept[chosen].mean() == pytest.approx(share, abs=0.03)
    floor = Scene((between((-90, -90, -1), (90, 90, 0)),))
    reach = [np.hypot(*Panorama(5000, noise=0, grazing=grazing)(floor, POSE, rng())[:, :2].T).max()
             for grazing in (50, 90)]  # fmt: skip
    assert reach[0] < reach[1]


def test_ranges_out_of_reach_are_lost():
    points = Panorama(8000, **PERFECT, nearest=2.0, farthest=4.5)(HALL, POSE, rng())
    ranges = np.linalg.norm(points, axis=1)
    assert 2.0 <= ranges.min() < 2.1 and 4.2 < ranges.max() <= 4.5


@pytest.mark.parametrize(
    ("key", "value"),
    [("rays", 0), ("noise", -1), ("mixed", 1.1), ("lost", -0.1), ("grazing", 91), ("nearest", -1),
     ("farthest", 0)],
)  # fmt: skip
def test_an_instrument_refuses_what_makes_no_sense(key, value):
    with pytest.raises(InputError, match=f"{key}={value} is out of range"):
        Instrument(**{key: value})
