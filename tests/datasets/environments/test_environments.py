"""The embedded environments as data sets."""

import subprocess
import sys

import numpy as np
import pytest
from omegaconf import OmegaConf

import mvreg
from mvreg.datasets.environments.base import Environment
from mvreg.datasets.environments.sets import Desk, Office, Room, Stationary, Street, Yard
from mvreg.datasets.environments.yard import HALF_TURN
from mvreg.datasets.mixture import Mixture
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, nearest

SETS = [Room, Office, Yard, Street, Desk]
#: So near are points of two scans that show the same place (m).
NEAR = {Room: 0.15, Office: 0.15, Yard: 0.3, Street: 0.4, Desk: 0.05}
EXACT = {"noise": 0, "mixed": 0, "rays": 2000}


def rng(seed=4):
    return np.random.default_rng(seed)


def world(scans):
    return [se3.apply(scans.poses[scan.name], scan.points) for scan in scans.scans]


@pytest.fixture(scope="module", params=SETS, ids=lambda cls: cls.__name__.lower())
def case(request):
    """A data set as it is, and its scans."""
    dataset = request.param()
    return dataset, dataset(rng())


def test_it_is_what_its_fields_say(case):
    dataset, scans = case
    assert (scans.name, scans.unit, len(scans.scans)) == (dataset.name, "m", dataset.scans)
    names = [scan.name for scan in scans.scans]
    assert names[:2] == [f"{dataset.name}_00", f"{dataset.name}_01"]
    assert list(scans.poses) == names
    for scan in scans.scans:
        assert 6000 < len(scan.points) < 25_000
        assert np.array_equal(scan.view_point, np.zeros(3)) and scan.view_direction is None
        pose = scans.poses[scan.name]
        assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-12)
    known = mvreg.dataset(dataset.name, scans=1, rays=600)
    assert known.name == dataset.name


def test_neighbours_overlap(case):
    dataset, scans = case
    points = world(scans)
    trees = [build_tree(each) for each in points]
    shares = [
        np.isfinite(nearest(trees[other], points[one], NEAR[type(dataset)])[0]).mean()
        for first in range(len(points) - 1)
        for one, other in ((first, first + 1), (first + 1, first))
    ]
    assert min(shares) > 0.25 and np.mean(shares) > 0.6


def test_stations_stand_apart_and_in_the_open(case):
    dataset, scans = case
    places = np.array([pose[:3, 3] for pose in scans.poses.values()])
    scene = dataset.scene()
    assert (scene.clearance(places) > 0.3).all()
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert (steps > 0.4).all() and (steps < 9).all()
    if isinstance(dataset, Street):
        assert ((steps > 2.5) & (steps < 5.5)).all()


@pytest.mark.parametrize("cls", SETS)
def test_the_same_rng_gives_the_same_scans(cls):
    dataset = cls(scans=3, rays=2000)
    once, again, other = dataset(rng()), dataset(rng()), dataset(rng(5))
    for first, second, third in zip(once.scans, again.scans, other.scans, strict=True):
        assert np.array_equal(first.points, second.points)
        assert np.array_equal(once.poses[first.name], again.poses[second.name])
        assert not np.allclose(once.poses[first.name], other.poses[third.name])


@pytest.mark.parametrize("cls", SETS)
@pytest.mark.parametrize("variant", [0, 3])
def test_poses_are_exact_without_errors(cls, variant):
    dataset = cls(**EXACT, variant=variant, scans=4)
    scene = dataset.scene()
    scans = dataset(rng(variant))
    for scan, points in zip(scans.scans, world(scans), strict=True):
        assert np.abs(scene.clearance(points[::5])).max() < 1e-9
        sensor = scans.poses[scan.name][:3, 3]
        assert (scene.clearance(sensor + 0.95 * (points[::5] - sensor)) > 0).all()


@pytest.mark.parametrize("cls", SETS)
def test_the_view_point_is_where_the_rays_meet(cls):
    settings = {"mixed": 0, "lost": 0, "rays": 2000, "scans": 2, "farthest": 1000, "nearest": 0}
    exact, noisy = (cls(noise=noise, scramble=True, **settings)(rng()) for noise in (0, 5.0))
    for before, after in zip(exact.scans, noisy.scans, strict=True):
        # Scrambling shifts by the scan's extent, which the noise changes: compare in one frame.
        motion = se3.invert(exact.poses[before.name]) @ noisy.poses[after.name]
        moved = after.moved(motion)
        rays = moved.points - before.points
        lengths = np.linalg.norm(rays, axis=1)
        rays, starts = (rays / lengths[:, None])[lengths > 1e-3], before.points[lengths > 1e-3]
        across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
        met = np.linalg.solve(across.sum(axis=0), (across @ starts[:, :, None]).sum(axis=0)[:, 0])
        assert met == pytest.approx(before.view_point, abs=1e-6)
        assert moved.view_point == pytest.approx(before.view_point, abs=1e-9)


@pytest.mark.parametrize("cls", SETS)
def test_errors_and_losses_grow_with_their_parameters(cls):
    def off_surface(**settings):
        dataset = cls(scans=1, rays=4000, **settings)
        scans = dataset(rng())
        return np.abs(dataset.scene().clearance(world(scans)[0]))

    mixed = [(off_surface(noise=0, mixed=mixed) > 0.02).mean() for mixed in (0, 0.3, 1.0)]
    assert mixed[0] == 0 < mixed[1] < mixed[2]
    noise = [np.median(off_surface(noise=noise, mixed=0)) for noise in (0, 1, 4)]
    assert noise[0] < 1e-9 and 1e-4 < noise[1] < 0.03 and 2 * noise[1] < noise[2]
    counts = [len(off_surface(lost=lost)) for lost in (0, 0.5)]
    assert counts[1] / counts[0] == pytest.approx(0.5, abs=0.05)
    assert len(off_surface(grazing=40)) < len(off_surface(grazing=90))


@pytest.mark.parametrize("cls", SETS)
def test_a_sensor_may_be_unknown(cls):
    scans = cls(scans=2, rays=600, sensor="unknown")(rng())
    assert all(not scan.knows_sensor for scan in scans.scans)
    known = cls(scans=2, rays=600, sensor="auto")(rng())
    assert np.array_equal(scans.scans[1].points, known.scans[1].points)


@pytest.mark.parametrize("cls", SETS)
def test_variants_are_other_scenes_and_runs_are_not(cls):
    first, second = cls(**EXACT, scans=2), cls(**EXACT, scans=2, variant=1)
    assert second.name == f"{first.name}_1"

    def elsewhere(scans):
        """Share of the points, but for the ground's, that are not in the first scene."""
        points = np.concatenate(world(scans))
        return (np.abs(first.scene().clearance(points[np.abs(points[:, 2]) > 1e-6])) > 0.01).mean()

    assert elsewhere(first(rng(8))) == 0
    assert elsewhere(second(rng())) > (0.25 if cls is Office else 0.4)  # ceilings are as high


@pytest.mark.parametrize("cls", [Room, Office, Yard])
def test_tripods_find_room_whatever_the_variant(cls):
    for variant in range(12):
        dataset: Stationary = cls(variant=variant)
        for pose in dataset.site().tripods(dataset.scans, rng(variant)):
            assert 1.5 <= pose[2, 3] <= 1.7
            assert np.allclose(pose[2, :3], [0, 0, 1])  # levelled
            assert dataset.site().clear(pose[:2, 3], pose[2, 3]), (variant, pose[:3, 3])


@pytest.mark.parametrize("variant", [0, 1, 2])
def test_the_yard_is_its_own_image_under_half_a_turn_but_for_small_things(variant):
    dataset = Yard(noise=0, mixed=0, rays=6000, scans=3, variant=variant)
    points = np.concatenate(world(dataset(rng())))
    off = np.abs(dataset.scene().clearance(se3.apply(HALF_TURN, points)))
    assert 0.97 < (off < 1e-9).mean() < 0.9999
    for quarter in (np.diag([1.0, -1, 1, 1]), np.diag([-1.0, 1, 1, 1])):  # no mirror image
        off = np.abs(dataset.scene().clearance(se3.apply(quarter, points)))
        assert (off < 0.01).mean() < 0.9


def test_a_longer_street_is_the_same_at_its_beginning():
    short, long = Street(scans=3, **EXACT), Street(scans=8, **EXACT)
    points = world(short(rng()))[0]
    near = points[np.linalg.norm(points[:, :2], axis=1) < 15]
    assert (np.abs(long.scene().clearance(near)) < 1e-9).mean() > 0.95


def test_two_rooms_can_be_in_one_folder():
    scans = Mixture(of=["room scans=2 rays=600", "room variant=1 scans=2 rays=600"])(rng())
    assert sorted(set(scans.objects.values())) == ["room", "room_1"]
    assert len(scans.scans) == 4


@pytest.mark.parametrize("cls", SETS)
def test_a_configuration_holds_all_its_fields(cls):
    node = OmegaConf.structured(cls)
    OmegaConf.set_readonly(node, None)
    node.noise, node.sensor = 0.5, "unknown"
    assert OmegaConf.to_object(node) == cls(noise=0.5, sensor="unknown")


@pytest.mark.parametrize(
    ("key", "value"),
    [("scans", 0), ("rays", 100), ("noise", -0.1), ("mixed", 1.5), ("lost", 1), ("grazing", 91),
     ("nearest", -1), ("farthest", 0.1), ("variant", -1), ("sensor", "lost"), ("order", "none")],
)  # fmt: skip
def test_it_refuses_what_makes_no_sense(key, value):
    with pytest.raises(InputError, match=rf"dataset\.{key}='?{value}'?: expected"):
        Room(**{key: value})


def test_what_every_environment_must_define():
    with pytest.raises(NotImplementedError):
        Environment().scene()


def test_importing_the_data_sets_is_cheap():
    code = (
        "import sys, mvreg.datasets.environments.sets\n"
        "heavy = {'open3d', 'scipy', 'mvreg.datasets.environments.office'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
