"""The bound on synthetic scans: against cases worked by hand, and its table and figure."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.stages.adjust.joint.correspondences import Contacts
from mvreg.stages.adjust.joint.surface import surfaces
from mvreg.testing import blob_scans, blob_views
from mvreg.types import Result


def near_views(count=3):
    """The blob's views, whose scans are given a sensor nearby instead of one far away."""
    views = []
    for view in blob_views(count):
        point = view.scan.points.mean(axis=0) + 400 * view.scan.view_direction
        views.append(replace(view, scan=replace(view.scan, view_direction=None, view_point=point)))
    return views


def truth(views):
    from experiments.accuracy.bound import rebased

    return rebased(blob_scans(3).poses, views)


def test_the_bound_goes_with_the_noise():
    from experiments.accuracy.bound_theory import bound, scatter

    views = near_views()
    once, thrice = (scatter(views, truth(views), bound(views, truth(views), n)) for n in (0.1, 0.3))
    assert thrice == pytest.approx(3 * once)
    # Six unknowns a scan, two thousand points shared: a few hundredths of the noise.
    assert 0.01 * 0.1 < once < 0.3 * 0.1


def test_the_bound_falls_with_the_number_of_points():
    """Every fourth raw point says a quarter as much."""
    from experiments.accuracy.bound_theory import bound, scatter

    views = near_views()
    thin = [replace(v, scan=replace(v.scan, points=v.scan.points[::4])) for v in views]
    right = truth(views)
    many, few = (scatter(s, right, bound(s, right, 0.1)) for s in (views, thin))
    assert few == pytest.approx(2 * many, rel=0.25)


def test_no_estimate_is_better_than_the_bound():
    """Not the joint refinement either, over eight draws of noise."""
    from experiments.accuracy.bound_theory import bound, displacement, scatter
    from mvreg.stages.adjust.joint.stage import JointRefinement
    from mvreg.testing import pipeline

    errors, noise = [], 0.3
    for number in range(8):
        rng, scans = np.random.default_rng(number), []
        for view in near_views():
            away = view.scan.points - view.scan.view_point
            rays = away / np.linalg.norm(away, axis=1, keepdims=True)
            errors_along = noise * rng.normal(size=(len(rays), 1))
            scans.append(replace(view.scan, points=view.scan.points + errors_along * rays))
        views = pipeline().prepare(scans, np.random.default_rng(0))
        start = Result(views[0].name, truth(views), (), ())
        found = JointRefinement()(start, views, pipeline())
        errors.append(displacement(views, truth(views), found.poses))
    views = near_views()
    least = scatter(views, truth(views), bound(views, truth(views), noise))
    ratio = np.sqrt(np.mean(np.square(errors))) / least
    assert 0.9 < ratio < 2.1


def test_weights_of_three_scans_worked_by_hand():
    from experiments.accuracy.bound_theory import weigh

    shapes = surfaces(near_views())
    ones = [np.ones(len(shape.points)) for shape in shapes]
    five = np.array([5, 5])
    found = Contacts(np.array([[0, 1], [0, 2]]), np.arange(3), five, five, np.ones(2))
    weighted = weigh(shapes, found, [3 * ones[0], 2 * ones[1], 5 * ones[2]])
    area = shapes[0].counts[5] / shapes[0].density[5]
    np.testing.assert_allclose(weighted.weights, area * 3 * np.array([2, 5]) / 10 / 2)


def test_precision_of_slanted_rays():
    from experiments.accuracy.bound_theory import precision

    view = near_views()[0]
    (surface,) = surfaces([view])
    found = precision(surface, view.scan)
    towards = view.scan.view_point - surface.points
    cosines = (towards * surface.normals).sum(axis=1) / np.linalg.norm(towards, axis=1)
    middle = cosines > 0.2
    np.testing.assert_allclose(found[middle] * cosines[middle] ** 2, surface.density[middle])
    assert (found <= 100.001 * surface.density).all()


def test_displacement_and_scatter_of_known_motions():
    from experiments.accuracy.bound_theory import displacement, scatter

    views = near_views()
    right = truth(views)
    shifted = {
        name: se3.from_parts(np.eye(3), np.array([0.3, 0, 0.4])) @ pose if k else pose
        for k, (name, pose) in enumerate(right.items())
    }
    assert displacement(views, right, shifted) == pytest.approx(0.5)
    covariance = np.diag([0, 0, 0, 0.09, 0.16, 0])
    assert scatter(views, right, dict.fromkeys(right, covariance)) == pytest.approx(0.5)
    turned = np.diag([0, 0, 1e-4, 0, 0, 0])
    squares = [
        (se3.apply(right[v.name], v.points[:: max(1, len(v.points) // 200)])[:, :2] ** 2).sum(1)
        for v in views[1:]
    ]
    expected = 1e-2 * np.sqrt(np.mean([square.mean() for square in squares]))
    assert scatter(views, right, dict.fromkeys(right, turned)) == pytest.approx(expected)


def measured(shape="blob-0", noise=0.1, method=0.5):
    from experiments.accuracy.bound_page import Measured

    return Measured(shape, noise, 0.1, 0.2, 0.3, 6.5, 0.94, method)


def test_a_line_of_the_table():
    from experiments.accuracy.bound_page import row

    expected = "| blob-0 | 0.1 | 0.1000 | 0.2000 | 2.00 | 0.5000 | 0.3000 | 6.5 | 0.94 |"
    assert row(measured()) == f"{expected}  |  | 1 |"
    assert row(replace(measured(), peers=(0.25, 1.0))) == f"{expected} 2.5 | 10.0 | 1 |"
    silent = row(replace(measured(noise=0.0, method=None), bound=0.0))
    expected = "| blob-0 | 0 | 0.0000 | 0.2000 |  | not all placed | 0.3000 | 6.5 | 0.94 |"
    assert silent == f"{expected}  |  | 1 |"


def test_draws_are_kept_and_a_run_goes_on(tmp_path):
    from experiments.accuracy.bound import finished
    from experiments.accuracy.bound_draws import Draw, Drawer

    asked, cases = [], [("gnome", 0.1), ("room", 3.0)]

    def make(shape, noise, run, peers):
        asked.append((shape, noise, run))
        lengths = np.array([1.0, 2.0, 3.0]) * (run + 1)
        return Draw(lengths, np.array([6.0, 20.0]), None if run else 0.5, (4.0,) * peers)

    def broken(shape, noise, run, peers):
        if run:
            raise KeyboardInterrupt
        return make(shape, noise, run, peers)

    with pytest.raises(KeyboardInterrupt):
        for run in range(2):
            Drawer(tmp_path, broken)("gnome", 0.1, run, False)
    drawer = Drawer(tmp_path, make)
    for run in range(2):
        drawer("gnome", 0.1, run, False)
    assert asked == [("gnome", 0.1, 0), ("gnome", 0.1, 1)]
    (found,) = finished(cases, 30, drawer)
    assert (found.draws, found.squared, found.inside, found.method) == (2, 13.0, 0.5, 0.5)
    assert found.error == pytest.approx(np.sqrt((4 + 16) / 2))
    drawer("gnome", 0.1, 0, True)  # with peers it is another draw
    assert asked[-1] == ("gnome", 0.1, 0)
    assert drawer.kept("gnome", 0.1, 0).peers == (4.0,)


def test_noise_that_grows_with_the_range_is_in_the_bound():
    """Twice as much at every range is twice the bound."""
    from experiments.accuracy.bound_theory import bound, scatter

    views = near_views()
    once = bound(views, truth(views), 0.1)
    twice = bound(views, truth(views), 0.1, lambda ranges: np.full_like(ranges, 2.0))
    assert scatter(views, truth(views), twice) == pytest.approx(
        2 * scatter(views, truth(views), once)
    )


@pytest.mark.parametrize("peer", ["Open3D", "small_gicp"])
def test_peers_come_near_the_truth_from_spoilt_poses(peer):
    from experiments.accuracy.bound_peers import PEERS
    from experiments.accuracy.bound_theory import displacement
    from experiments.accuracy.floor import spoilt

    pytest.importorskip("small_gicp")
    views = near_views()
    right = truth(views)
    start = spoilt(right, views, np.random.default_rng(0))
    found = PEERS[peer](views, start)
    assert displacement(views, right, found) < 0.3 * displacement(views, right, start)


def test_squared_errors_of_gaussian_poses(rng):
    """Six unknowns, as the covariance says: 6 in the mean, and 95 in 100 inside."""
    from experiments.accuracy.bound import normalised
    from experiments.accuracy.bound_draws import INSIDE

    root = np.diag([0.1, 0.2, 0.1, 3.0, 1.0, 2.0]) @ rng.normal(size=(6, 6)) * 1e-3
    true = se3.random(rng, 10.0)
    errors = rng.normal(size=(2000, 6)) @ root.T
    squared = [normalised(se3.exp(one) @ true, true, root @ root.T) for one in errors]
    assert np.mean(squared) == pytest.approx(6, rel=0.05)
    assert np.mean(np.less(squared, INSIDE)) == pytest.approx(0.95, abs=0.015)


def test_families_are_pooled():
    from experiments.accuracy.bound_page import pooled

    other = replace(measured("blob-1"), error=0.4, method=None)
    by = pooled([measured(), other, measured("gnome")])
    assert set(by) == {"blob", "gnome"}
    mean = np.sqrt((0.04 + 0.16) / 2)
    np.testing.assert_allclose(by["blob"][0.1], [0.1, mean, 0.3, np.nan])
    np.testing.assert_allclose(by["gnome"][0.1], [0.1, 0.2, 0.3, 0.5])


def test_the_figure_has_a_panel_for_each_family(tmp_path):
    from experiments.accuracy.bound_page import draw, pooled
    from experiments.common.style import save, styled

    rows = [measured(shape, noise) for shape in ("gnome", "blob-0") for noise in (0.0, 0.1, 0.3)]
    with styled():
        figure = draw(pooled(rows))
        assert [axis.get_title() for axis in figure.axes] == ["gnome", "blob"]
        assert [text.get_text() for text in figure.axes[0].get_xticklabels()] == ["0", "0.1", "0.3"]
        assert save(figure, tmp_path / "bound.png").stat().st_size > 1000
