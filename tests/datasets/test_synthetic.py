"""The embedded data sets, and the shapes and the camera that they are made with."""

import os
import subprocess
import sys

import numpy as np
import pytest
from omegaconf import OmegaConf

from mvreg._open3d import load_open3d
from mvreg.datasets.base import Order
from mvreg.datasets.camera import RangeCamera
from mvreg.datasets.mesh import Mesh
from mvreg.datasets.raycast import Projection
from mvreg.datasets.relief import turned
from mvreg.datasets.sdf import ellipsoid
from mvreg.datasets.shapes import SHAPES, shape
from mvreg.datasets.surfacenets import surface_net
from mvreg.datasets.synthetic import Figurine, Tiny
from mvreg.datasets.viewpoints import look_at, orbit
from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, mean_spacing, nearest

NO_LOSSES = {"grazing": 90, "edge_dropout": 0}


def rng():
    return np.random.default_rng(5)


def closest(mesh, points):
    """Distances (N,) to the mesh, and its normals (N, 3) there."""
    tensor = load_open3d().core.Tensor((points - mesh.centre).astype(np.float32))
    answer = mesh.scene.compute_closest_points(tensor)
    offset = points - mesh.centre - answer["points"].numpy()
    return np.linalg.norm(offset, axis=1), answer["primitive_normals"].numpy()


def volume(mesh):
    a, b, c = (mesh.vertices[corner] for corner in mesh.triangles.T)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.fixture(scope="module")
def gnome():
    return shape("gnome")


@pytest.fixture(scope="module")
def tiny():
    return Tiny()(np.random.default_rng(0))


@pytest.fixture(scope="module")
def figurine():
    return Figurine()(np.random.default_rng(0))


# Shapes


@pytest.mark.parametrize("name", [*SHAPES, "blob-0", "blob-1"])
def test_shapes_are_closed_and_face_outwards(name):
    mesh = shape(name)
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges @ [len(mesh.vertices), 1], return_counts=True)
    assert (counts % 2 == 0).all()
    assert 50_000 < volume(mesh) < 1_000_000
    assert 120 <= mesh.size <= 210


def test_shapes_have_their_size():
    assert volume(shape("sphere")) == pytest.approx(4 / 3 * np.pi * 60**3, rel=1e-3)
    assert volume(shape("cylinder")) == pytest.approx(np.pi * 35**2 * 120, rel=1e-3)
    assert volume(shape("box")) == pytest.approx(80 * 50 * 110)


def test_surface_net_of_a_ball_lies_on_it():
    vertices, triangles = surface_net([ellipsoid((1, 2, 3), (20, 20, 20))], step=1.0)
    radius = np.linalg.norm(vertices - [1, 2, 3], axis=1)
    assert np.abs(radius - 20).max() < 2e-3
    middle = vertices[triangles].mean(axis=1)
    assert np.abs(np.linalg.norm(middle - [1, 2, 3], axis=1) - 20).max() < 0.03


def test_carving_takes_away_and_joining_adds():
    ball, bite = ellipsoid((0, 0, 0), (20, 20, 20)), ellipsoid((20, 0, 0), (8, 8, 8))
    knob = ellipsoid((20, 0, 0), (8, 8, 8), blend=3)
    hollow = ellipsoid((20, 0, 0), (8, 8, 8), carve=True)
    alone, joined, carved, second = (
        volume(Mesh(*surface_net(parts, step=1.0)))
        for parts in ([ball], [ball, knob], [ball, hollow], [bite])
    )
    assert carved < alone < joined
    # What the knob adds and what the hollow takes are the two halves of the second ball.
    assert joined - carved == pytest.approx(second, rel=0.1)


def test_the_figure_has_no_symmetry(gnome):
    assert np.ptp(gnome.vertices[:, 2]) == pytest.approx(153, abs=4)
    points = gnome.vertices[::200] - gnome.centre
    for degrees in range(30, 360, 30):
        around = points @ turned(z=degrees).T
        assert np.median(closest(gnome, around + gnome.centre)[0]) > 1.5
    for axis in range(3):
        mirrored = points * np.where(np.arange(3) == axis, -1, 1)
        assert np.median(closest(gnome, mirrored + gnome.centre)[0]) > 1.5


def test_blobs_differ_and_repeat():
    first = shape("blob-3").vertices
    assert np.array_equal(first, shape.__wrapped__("blob-3").vertices)
    other = shape("blob-4").vertices
    assert first.shape != other.shape or not np.allclose(first, other)


@pytest.mark.parametrize("name", ["dwarf", "blob", "blob-x", "blob--1", ""])
def test_an_unknown_shape_is_an_error_with_the_options(name):
    with pytest.raises(InputError, match=r"is not known; options: gnome, .*bottle, blob-0"):
        shape(name)


# Camera


@pytest.mark.parametrize("projection", list(Projection))
def test_exact_points_lie_on_the_surface_and_face_the_sensor(gnome, projection):
    pose = orbit(gnome.centre, 400, 70, 20, roll=30)
    scan = RangeCamera(8000, projection)(gnome, pose, rng())
    distance, normals = closest(gnome, se3.apply(pose, scan.points))
    assert distance.max() < 1e-4
    if projection is Projection.perspective:
        assert scan.view_direction is None and np.array_equal(scan.view_point, np.zeros(3))
        towards = scan.view_point - scan.points
    else:
        assert scan.view_point is None and np.array_equal(scan.view_direction, [0, 0, 1])
        towards = np.tile(scan.view_direction, (len(scan.points), 1))
    assert (np.einsum("ij,ij->i", normals, towards @ pose[:3, :3].T) > 0).mean() > 0.995
    assert (scan.points[:, 2] < 0).all()


@pytest.mark.parametrize("projection", list(Projection))
def test_nothing_hides_what_is_seen(gnome, projection):
    pose = orbit(gnome.centre, 400, 200, 40)
    scan = RangeCamera(2000, projection)(gnome, pose, rng())
    points = se3.apply(pose, scan.points)
    if projection is Projection.perspective:
        towards = pose[:3, 3] - points
    else:
        towards = np.tile(400 * pose[:3, 2], (len(points), 1))
    start = points + 1e-3 * towards
    rays = np.hstack([start - gnome.centre, towards]).astype(np.float32)
    hidden = gnome.scene.test_occlusions(load_open3d().core.Tensor(rays), 0, 0.99).numpy()
    assert hidden.mean() < 0.01


@pytest.mark.parametrize("projection", list(Projection))
def test_noise_and_quantisation_are_as_asked(gnome, projection):
    pose = orbit(gnome.centre, 400, 0, 20)
    exact = RangeCamera(9000, projection)(gnome, pose, rng()).points
    noisy = RangeCamera(9000, projection, noise=0.1, quantisation=0.2)(gnome, pose, rng()).points
    if projection is Projection.perspective:
        ranges, measured = np.linalg.norm(exact, axis=1), np.linalg.norm(noisy, axis=1)
        assert np.allclose(exact / ranges[:, None], noisy / measured[:, None])
    else:
        ranges, measured = -exact[:, 2], -noisy[:, 2]
        assert np.array_equal(exact[:, :2], noisy[:, :2])
    error = measured - ranges
    assert np.sqrt((error**2).mean()) == pytest.approx(np.hypot(0.1, 0.2 / np.sqrt(12)), rel=0.05)
    assert abs(error.mean()) < 0.01
    assert np.allclose(measured / 0.2, np.round(measured / 0.2))


def test_points_are_lost_at_grazing_angles():
    ball = shape("sphere")
    pose = orbit(ball.centre, 400, 0, 0)

    def angles(camera):
        points = camera(ball, pose, rng()).points
        world = se3.apply(pose, points) - ball.centre
        cosine = np.einsum("ij,ij->i", world, -points @ pose[:3, :3].T)
        cosine /= np.linalg.norm(world, axis=1) * np.linalg.norm(points, axis=1)
        return np.degrees(np.arccos(cosine))

    keeps_all = angles(RangeCamera(20_000, **NO_LOSSES))
    loses = angles(RangeCamera(20_000, grazing=60, edge_dropout=0))
    assert keeps_all.max() > 88
    assert (keeps_all > 75).mean() > 2.5 * (loses > 75).mean() > 0
    assert (loses < 55).mean() > (keeps_all < 55).mean()


def test_points_are_lost_at_edges():
    plate = shape("plate")
    pose = orbit(plate.centre, 400, 0, 0)
    keeps = RangeCamera(10_000, edge_dropout=0)(plate, pose, rng()).points
    loses = RangeCamera(10_000, edge_dropout=1)(plate, pose, rng()).points
    pixel = mean_spacing(keeps)
    assert np.ptp(keeps[:, 0]) == pytest.approx(120, abs=1.5 * pixel)
    assert np.ptp(loses[:, 0]) == pytest.approx(np.ptp(keeps[:, 0]) - 2 * pixel, abs=0.1 * pixel)


@pytest.mark.parametrize("projection", list(Projection))
@pytest.mark.parametrize("points", [500, 20_000])
@pytest.mark.parametrize("name", ["gnome", "plate", "blob-1"])
def test_the_number_of_points_is_as_asked(name, points, projection):
    mesh = shape(name)
    scan = RangeCamera(points, projection)(mesh, orbit(mesh.centre, 500, 25, 30), rng())
    assert len(scan.points) == pytest.approx(points, rel=0.2)


def test_the_field_of_view_cuts_and_keeps_the_number_of_points(gnome):
    pose = orbit(gnome.centre, 400, 25, 30)
    narrow = RangeCamera(5000, field_of_view=8)(gnome, pose, rng()).points
    tangents = np.abs(narrow[:, :2] / narrow[:, 2:])
    assert np.tan(np.radians(3.8)) < tangents.max() <= np.tan(np.radians(4)) * 1.02
    assert len(narrow) == pytest.approx(5000, rel=0.2)
    window = RangeCamera(5000, Projection.orthographic, window=50)(gnome, pose, rng()).points
    assert 24 < np.abs(window[:, :2]).max() <= 25.5


def test_a_camera_inside_sees_what_is_in_front_of_it():
    pose = look_at(np.zeros(3), np.array([1.0, 0, 0]))
    scan = RangeCamera(3000)(shape("sphere"), pose, rng())
    assert np.allclose(np.linalg.norm(scan.points, axis=1), 60, atol=0.02)
    assert (scan.points[:, 2] < 0).all()


@pytest.mark.parametrize("projection", list(Projection))
def test_a_camera_that_looks_away_says_so(gnome, projection):
    away = look_at(np.array([0.0, -400, 80]), np.array([0.0, -800, 80]))
    with pytest.raises(InputError, match="scan 'back': the range camera sees nothing"):
        RangeCamera(1000, projection)(gnome, away, rng(), "back")


def test_the_answer_does_not_depend_on_where_the_world_is(gnome):
    """Far from the origin, single precision is no excuse."""
    shift = np.array([1e6, -2e6, 5e5])
    far = Mesh(gnome.vertices + shift, gnome.triangles)
    camera = RangeCamera(2000)
    here = camera(gnome, orbit(gnome.centre, 400, 10, 10), rng())
    there = camera(far, orbit(gnome.centre + shift, 400, 10, 10), rng())
    assert len(here.points) == len(there.points)
    assert np.abs(here.points - there.points).max() < 1e-3


def test_the_same_rng_gives_the_same_scan(gnome):
    pose = orbit(gnome.centre, 400, 10, 10)
    camera = RangeCamera(2000, noise=0.1)
    first, second = (camera(gnome, pose, rng()).points for _ in range(2))
    assert np.array_equal(first, second)
    other = camera(gnome, pose, np.random.default_rng(6)).points
    assert first.shape != other.shape or not np.array_equal(first, other)


@pytest.mark.parametrize(
    ("key", "value"),
    [("points", 0), ("field_of_view", 180), ("window", 0), ("noise", -1), ("quantisation", -1),
     ("grazing", 91), ("edge_dropout", 1.1), ("edge_jump", 0)],
)  # fmt: skip
def test_a_camera_refuses_what_makes_no_sense(key, value):
    with pytest.raises(InputError, match=f"{key}={value} is out of range"):
        RangeCamera(**{key: value})


@pytest.mark.parametrize("elevation", [-90, -30, 0, 90])
def test_an_orbiting_camera_looks_at_its_target(elevation):
    target = np.array([1.0, 2, 3])
    pose = orbit(target, 10, 50, elevation, roll=20)
    assert np.allclose(se3.apply(se3.invert(pose), target), [0, 0, -10])
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3))
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    upright = orbit(target, 10, 50, elevation)
    assert se3.rotation_angle(upright, pose) == pytest.approx(np.radians(20))
    assert upright[2, 1] >= 0  # Up in the picture is up in the world.


def test_a_camera_cannot_look_at_itself():
    with pytest.raises(InputError, match="two different points"):
        look_at(np.ones(3), np.ones(3))


# Data sets


def test_figurine_is_what_its_fields_say(figurine):
    assert (figurine.name, figurine.unit, len(figurine.scans)) == ("figurine", "mm", 12)
    assert [scan.name for scan in figurine.scans][:2] == ["figurine_00", "figurine_01"]
    for scan in figurine.scans:
        assert len(scan.points) == pytest.approx(30_000, rel=0.2)
        assert mean_spacing(scan.points) == pytest.approx(0.55, abs=0.15)


def test_tiny_is_the_same_figure_but_small(tiny, gnome):
    assert (tiny.name, tiny.unit, len(tiny.scans)) == ("tiny", "mm", 6)
    for scan in tiny.scans:
        assert len(scan.points) == pytest.approx(6000, rel=0.2)
        distance, _ = closest(gnome, se3.apply(tiny.poses[scan.name], scan.points))
        # The range's error is seen along the ray; across the surface it is smaller.
        assert 0.04 < np.sqrt((distance**2).mean()) < 0.08


@pytest.mark.parametrize("name", ["figurine", "tiny"])
def test_names_and_poses_belong_together(name, request):
    scans = request.getfixturevalue(name)
    names = [scan.name for scan in scans.scans]
    assert len(set(names)) == len(names)
    assert set(scans.poses) == set(names)
    for pose in scans.poses.values():
        assert np.allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-12)


def test_poses_are_exact_without_noise(gnome):
    scans = Tiny(noise=0, quantisation=0)(rng())
    for scan in scans.scans:
        distance, _ = closest(gnome, se3.apply(scans.poses[scan.name], scan.points))
        assert distance.max() < 1e-3


@pytest.mark.parametrize("name", ["figurine", "tiny"])
def test_neighbours_overlap(name, request):
    scans = request.getfixturevalue(name)
    world = [se3.apply(scans.poses[scan.name], scan.points) for scan in scans.scans]
    trees = [build_tree(points) for points in world]
    pairs = list(zip(range(len(world) - 1), range(1, len(world)), strict=True))
    if name == "figurine":
        pairs.append((len(world) - 1, 0))  # All the way around.
    for i, j in pairs:
        for source, target in ((i, j), (j, i)):
            bound = 2 * mean_spacing(world[target])
            distance, _ = nearest(trees[target], world[source], bound)
            assert np.isfinite(distance).mean() > 0.4


def test_the_scans_do_not_depend_on_the_runs_rng(tiny):
    again = Tiny()(np.random.default_rng(99))
    for first, second in zip(tiny.scans, again.scans, strict=True):
        assert first.name == second.name
        assert np.array_equal(first.points, second.points)
    other = Tiny(noise_rng=1)(np.random.default_rng(0))
    assert not np.allclose(tiny.poses["tiny_00"], other.poses["tiny_00"])


def test_poses_stay_true_when_shuffled_and_scrambled(tiny):
    moved = Tiny(order=Order.shuffle, scramble=True)(np.random.default_rng(1))
    before = {scan.name: scan for scan in tiny.scans}
    assert [scan.name for scan in moved.scans] != list(before)
    assert {scan.name for scan in moved.scans} == set(before)
    for scan in moved.scans:
        original = before[scan.name]
        world = se3.apply(tiny.poses[scan.name], original.points)
        assert np.allclose(se3.apply(moved.poses[scan.name], scan.points), world, atol=1e-9)
        assert np.abs(scan.points - original.points).max() > 10
        sensor = se3.apply(moved.poses[scan.name], scan.view_point[None])[0]
        stood = se3.apply(tiny.poses[scan.name], original.view_point[None])[0]
        assert np.allclose(sensor, stood)


def test_other_shapes_are_named_after_themselves():
    scans = Tiny(shape="bottle", views=2, points=500)(rng())
    assert scans.name == "tiny_bottle"
    assert [scan.name for scan in scans.scans] == ["tiny_bottle_00", "tiny_bottle_01"]


@pytest.mark.parametrize("cls", [Figurine, Tiny])
def test_a_configuration_holds_all_its_fields(cls):
    node = OmegaConf.structured(cls)
    OmegaConf.set_readonly(node, None)
    node.noise = 0.5
    assert OmegaConf.to_object(node) == cls(noise=0.5)


@pytest.mark.parametrize(
    ("key", "value"),
    [("views", 0), ("points", 99), ("noise", -0.1), ("quantisation", -1), ("noise_rng", -1),
     ("noise", float("nan"))],
)  # fmt: skip
def test_a_data_set_refuses_what_makes_no_sense(key, value):
    with pytest.raises(InputError, match=f"dataset.{key}={value}: expected"):
        Tiny(**{key: value})


def test_an_unknown_figure_is_an_error():
    with pytest.raises(InputError, match="shape='dwarf' is not known"):
        Tiny(shape="dwarf")(rng())


def test_importing_the_data_set_is_cheap():
    code = (
        "import sys, mvreg.datasets.synthetic\n"
        "heavy = {'open3d', 'scipy', 'mvreg.datasets.gnome'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_views_are_as_far_apart_as_they_may_be():
    def steps(widest):
        scans = Tiny(views=4, points=300, widest_step=widest)(np.random.default_rng(0))
        poses = np.stack([scans.poses[scan.name] for scan in scans.scans])
        return np.degrees(se3.rotation_angle(poses[:-1], poses[1:]))

    near, far = steps(40), steps(200)  # four views all around are 90 degrees apart
    assert (far - near > 30).all() and (far < 110).all()
    with pytest.raises(InputError, match="widest_step"):
        Tiny(widest_step=-1)


@pytest.mark.parametrize("kernels", ["Prescott", "Haswell"])
def test_that_processors_that_round_otherwise_make_the_same_scans(kernels, tmp_path):
    """Of x86: elsewhere both are the same as ever."""
    code = "import numpy, sys, mvreg; numpy.savez(sys.argv[1], *[scan.points for scan in " \
           "mvreg.dataset('tiny').scans])"  # fmt: skip
    file = tmp_path / "scans.npz"
    subprocess.run(
        [sys.executable, "-c", code, str(file)],
        check=True,
        env=os.environ | {"OPENBLAS_CORETYPE": kernels},
    )
    here = Tiny().load(rng()).scans
    with np.load(file) as found:
        for scan, points in zip(here, found.values(), strict=True):
            np.testing.assert_allclose(points, scan.points, rtol=0, atol=1e-9)
