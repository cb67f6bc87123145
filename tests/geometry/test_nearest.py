import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mvreg.geometry import nearest
from mvreg.testing import blob_scans

rngs = st.integers(0, 2**32 - 1).map(np.random.default_rng)
quick = settings(max_examples=40, deadline=None)


@quick
@given(rngs, st.integers(1, 60), st.sampled_from([0.05, 0.3, 1.0, np.inf]))
def test_the_nearest_is_what_brute_force_finds(rng, count, bound):
    points, queries = rng.uniform(size=(count, 3)), rng.uniform(size=(30, 3))
    distances, indices = nearest.nearest(nearest.build_tree(points), queries, bound)
    table = np.linalg.norm(queries[:, None] - points[None], axis=2)
    near = table.min(axis=1) < bound
    np.testing.assert_allclose(distances[near], table.min(axis=1)[near])
    np.testing.assert_array_equal(indices[near], table.argmin(axis=1)[near])
    assert np.isinf(distances[~near]).all()
    assert (indices[~near] == count).all()


def test_workers_do_not_change_the_answer(monkeypatch):
    points, queries = (scan.points for scan in blob_scans(2).scans)
    many = np.concatenate([queries + 0.01 * step for step in range(20)])
    tree = nearest.build_tree(points)
    answers = []
    assert len(many) > 3 * nearest.FEW
    for workers in ("1", "2", "5"):
        monkeypatch.setenv("OMP_NUM_THREADS", workers)
        answers.append((*nearest.nearest(tree, many, 10.0), nearest.mean_spacing(points, tree)))
    for distances, indices, spacing in answers[1:]:
        np.testing.assert_array_equal(distances, answers[0][0])
        np.testing.assert_array_equal(indices, answers[0][1])
        assert spacing == answers[0][2]


@quick
@given(rngs, st.integers(2, 40))
def test_the_spacing_is_the_mean_distance_to_the_nearest_other(rng, count):
    points = rng.normal(size=(count, 3))
    table = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(table, np.inf)
    expected = table.min(axis=1).mean()
    assert nearest.mean_spacing(points) == pytest.approx(expected)
    assert nearest.mean_spacing(points, nearest.build_tree(points)) == pytest.approx(expected)
    assert nearest.mean_spacing(points * 1024) == pytest.approx(expected * 1024)


def test_the_spacing_of_a_grid_is_its_step():
    grid = np.stack(np.meshgrid(*[np.arange(9.0)] * 3), axis=-1).reshape(-1, 3) * 0.25
    assert nearest.mean_spacing(grid) == pytest.approx(0.25)
    assert nearest.mean_spacing(grid, most=50) == pytest.approx(0.25)


def test_only_some_points_are_asked(rng):
    points = np.cumsum(np.arange(100.0))[:, None] * [1, 0, 0]  # gaps of 1, 2, 3, ...
    assert nearest.mean_spacing(points) < nearest.mean_spacing(points[50:])
    assert nearest.mean_spacing(points, most=1) == 1.0, "the first point's"


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.full((7, 3), 2.5)])
def test_where_all_points_coincide_there_is_no_spacing(points):
    assert nearest.mean_spacing(points) == 0.0


def test_duplicates_count_as_one(rng):
    points = np.array([[0, 0, 0], [0, 0, 0], [2, 0, 0], [4, 0, 0.0]])
    assert nearest.mean_spacing(points) == 2.0


def test_the_spacing_of_a_set_is_the_median():
    line = np.arange(10.0)[:, None] * [1, 0, 0]
    clouds = [line, 2 * line, 7 * line]
    assert nearest.median_spacing(clouds) == 2.0
    assert nearest.median_spacing([*clouds, np.zeros((3, 3))]) == 2.0, "points do not count"
    assert nearest.median_spacing([np.zeros((3, 3))]) == 0.0
    assert nearest.median_spacing([]) == 0.0


def test_a_cloud_given_twice_has_the_spacing_of_one(rng):
    points = rng.normal(size=(300, 3))
    twice = nearest.mean_spacing(np.repeat(points, 2, axis=0))
    assert twice == pytest.approx(nearest.mean_spacing(points))
