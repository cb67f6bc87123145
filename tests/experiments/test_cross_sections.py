"""Slabs hold the points that are in them, and the window is where the scans disagree."""

import numpy as np
import pytest

from mvreg.testing.scans import sphere_directions


def cloud(points, normals):
    from experiments.common.render import Cloud

    return Cloud(points, normals, np.zeros(points.shape))


def sphere(radius, centre=(0.0, 0.0, 0.0), count=20_000):
    directions = sphere_directions(count)
    return cloud(radius * directions + centre, directions)


def test_a_slab_holds_the_points_within_half_its_thickness():
    from experiments.report.cross_sections import PLANES, Slab

    origin = np.array([1.0, 2.0, 3.0])
    points = origin + np.array([[5, 0.9, 7], [5, -0.9, 7], [5, 1.1, 7], [-4, 0, 2.0]])
    normals = np.array([[1.0, 0, 0], [0, 1, 0], [1, 0, 0], [0.6, 0.8, 0]])
    section = Slab(origin, np.array(PLANES[1]), 2.0).cut(cloud(points, normals))
    # From above: x to the right and z towards the reader's feet.
    np.testing.assert_allclose(section.points, [[5, -7], [5, -7], [-4, -2]])
    assert section.steep.tolist() == [True, False, False]
    np.testing.assert_allclose(section.normals[[0, 2]], [[1, 0], [1, 0]])


@pytest.mark.parametrize("axis", range(3))
def test_planes_are_seen_from_outside(axis):
    from experiments.report.cross_sections import PLANES, Slab

    slab = Slab(np.zeros(3), np.array(PLANES[axis]), 1.0)
    np.testing.assert_allclose(slab.normal, np.eye(3)[axis])


def test_a_sphere_is_cut_in_a_circle():
    from experiments.report.cross_sections import PLANES, Slab

    section = Slab(np.array([0, 0, 6.0]), np.array(PLANES[2]), 0.1).cut(sphere(10.0))
    assert len(section) > 50
    np.testing.assert_allclose(np.linalg.norm(section.points, axis=1), 8, atol=0.05)
    assert section.steep.all()
    np.testing.assert_allclose(section.points / 8, section.normals, atol=0.01)


def test_the_slab_goes_where_scans_overlap():
    from experiments.report.cross_sections import choose_slab

    # Two spheres that are in one place, and a third, alone, beside them.
    clouds = [sphere(10), sphere(10), sphere(10, (0, 30, 0))]
    slab = choose_slab(clouds, 0.5)
    assert np.linalg.norm(slab.normal) == 1
    inside = [abs((np.array(centre) - slab.origin) @ slab.normal) for centre in
              ((0, 0, 0), (0, 30, 0))]  # fmt: skip
    assert inside[0] < 5


def test_spread_is_measured_across_the_surface():
    from experiments.report.cross_sections import Section, spread

    along = np.linspace(0, 10, 101)
    flat = np.stack([along, np.zeros(101)], axis=1)
    up = np.tile([0.0, 1], (101, 1))
    steep = np.ones(101, dtype=bool)
    cut = {"a": Section(flat, up, steep), "b": Section(flat + np.array([0.05, 0.3]), up, steep),
           "back": Section(flat + np.array([0, 0.1]), -up, steep)}  # fmt: skip
    points, distances = spread(cut, 1.0)
    assert len(points) == 202  # all of a and b, and none of what faces away
    np.testing.assert_allclose(distances, 0.3)


def test_spread_ends_where_another_scan_ends():
    from experiments.report.cross_sections import Section, spread

    along = np.linspace(0, 10, 101)
    line = np.stack([along, np.zeros(101)], axis=1)
    up = np.tile([0.0, 1], (101, 1))
    steep = np.ones(101, dtype=bool)
    cut = {"a": Section(line, up, steep), "b": Section(line[:50], up[:50], steep[:50])}
    points, distances = spread(cut, 1.05)
    assert points[:, 0].max() == pytest.approx(5.9)
    np.testing.assert_allclose(distances, 0, atol=1e-12)


def test_the_window_is_where_the_worst_result_disagrees():
    from experiments.report.cross_sections import Section, choose_window

    along = np.linspace(0, 100, 1001)
    up = np.tile([0.0, 1], (1001, 1))
    steep = np.ones(1001, dtype=bool)

    def result(size):
        gap = np.where(np.abs(along - 70) < 10, size, 0.1)
        return {"a": Section(np.stack([along, 0 * along], axis=1), up, steep),
                "b": Section(np.stack([along, gap], axis=1), up, steep)}  # fmt: skip

    window = choose_window([result(0.2), result(1.5), result(0.1)], 5.0, 4.0)
    assert window.half == 5
    assert 65 <= window.centre[0] <= 75
    assert window.holds(np.array([[70.0, 0.0], [0.0, 0.0]])).tolist() == [True, False]


def test_a_window_of_one_scan_alone():
    from experiments.report.cross_sections import Section, choose_window

    only = Section(np.array([[1.0, 2], [3, 4]]), np.tile([0.0, 1], (2, 1)), np.ones(2, dtype=bool))
    assert np.isfinite(choose_window([{"a": only}], 1.0, 1.0).centre).all()


def test_round_lengths():
    from experiments.report.panels import round_length

    assert [round_length(x) for x in (0.7, 4.9, 5.0, 23, 199)] == [0.5, 2, 5, 20, 100]
