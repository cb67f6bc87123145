from dataclasses import replace

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.stages.adjust import view_graph
from mvreg.stages.adjust.lrs import decomposition, stage
from mvreg.stages.adjust.lrs.stage import LowRankSparse
from mvreg.testing import blob_views, pipeline
from mvreg.testing.adjust import nearly_right
from mvreg.testing.refine import nudge
from mvreg.testing.views import plain_view
from mvreg.types import Array, Edge


def ring(count: int, chords: float, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Exact poses and relative motions; a ring of pairs is known, and a share of the others."""
    poses = np.stack([np.eye(4), *(se3.random(rng, 1.0) for _ in range(count - 1))])
    known = np.triu(rng.uniform(size=(count, count)) < chords, 2)
    known[np.arange(count - 1), np.arange(1, count)] = known[0, -1] = True
    return poses, se3.invert(poses)[:, None] @ poses[None], (known | known.T).astype(float)


def small(degrees: float, shift: float, rng: np.random.Generator) -> Array:
    axis = rng.normal(size=3)
    half = np.deg2rad(degrees) / 2
    turn = np.append(np.sin(half) * axis / np.linalg.norm(axis), np.cos(half))
    return se3.from_parts(se3.rotation_from_quaternion(turn), shift * rng.normal(size=3))


def shaken(poses: Array, degrees: float, rng: np.random.Generator) -> Array:
    return np.stack([poses[0], *(p @ small(degrees, 0.02 * degrees, rng) for p in poses[1:])])


def apart(first: Array, second: Array) -> float:
    return float(np.abs(first - second).max())


@pytest.mark.parametrize("degrees", [2.0, 30.0])
def test_exact_motions_with_gaps_give_exact_poses(degrees: float, rng: np.random.Generator) -> None:
    poses, relative, known = ring(10, 0.4, rng)
    assert (known == 0).sum() > 30
    begin = shaken(poses, degrees, rng)
    assert apart(decomposition.synchronise(relative, known, begin, 0), poses) < 1e-4


@pytest.mark.parametrize("number", [3, 8])
def test_fourth_rows_of_unknown_motions_are_known(number: int) -> None:
    """Far from the truth, with few pairs known, they decide: without them these two are lost."""
    rng = np.random.default_rng(number)
    poses, relative, known = ring(10, 0.2, rng)
    begin = shaken(poses, 75.0, rng)
    assert apart(decomposition.synchronise(relative, known, begin, 0), poses) < 1e-3


def test_unknown_motions_do_not_count(rng: np.random.Generator) -> None:
    poses, relative, known = ring(8, 0.4, rng)
    relative = np.where((known > 0)[..., None, None], relative, 1e3)
    assert (
        apart(decomposition.synchronise(relative, known, shaken(poses, 2.0, rng), 0), poses) < 1e-4
    )


@pytest.mark.parametrize("bad", [1, 3])
def test_a_few_gross_outliers_change_nothing(bad: int, rng: np.random.Generator) -> None:
    poses, relative, known = ring(10, 0.6, rng)
    pairs = np.argwhere(np.triu(known) > 0)
    for i, j in pairs[rng.choice(len(pairs), bad, replace=False)]:
        relative[i, j] = se3.random(rng, 1.0)
        relative[j, i] = se3.invert(relative[i, j])
    found = decomposition.synchronise(relative, known, shaken(poses, 2.0, rng), 0)
    assert apart(found, poses) < 1e-4


def test_noise_is_averaged() -> None:
    """Over ten draws, poses are nearer to the truth than those of a chain of the same motions."""
    off: list[list[float]] = [[], []]
    for number in range(10):
        rng = np.random.default_rng(number)
        poses, relative, known = ring(8, 0.8, rng)
        for i, j in np.argwhere(np.triu(known) > 0):
            relative[i, j] = relative[i, j] @ small(1.0, 0.02, rng)
            relative[j, i] = se3.invert(relative[i, j])
        chain = [np.eye(4)]
        for k in range(7):
            chain.append(chain[-1] @ relative[k, k + 1])
        found = decomposition.synchronise(relative, known, np.stack(chain), 0)
        for errors, some in zip(off, (np.stack(chain), found), strict=True):
            errors.append(float(se3.rotation_angle(some, poses).mean()))
    assert np.mean(off[1]) < 0.7 * np.mean(off[0])


def test_the_reference_stays(rng: np.random.Generator) -> None:
    poses, relative, known = ring(8, 0.6, rng)
    begin = shaken(poses, 3.0, rng)
    found = decomposition.synchronise(relative, known, begin, 5)
    np.testing.assert_array_equal(found[5], begin[5])
    moved = begin[5] @ se3.invert(poses[5])
    assert apart(found, moved @ poses) < 1e-4


def test_a_row_that_is_no_motion_changes_no_pose(rng: np.random.Generator) -> None:
    poses = np.stack([se3.random(rng) for _ in range(3)])
    row = np.stack([np.eye(4), np.full((4, 4), np.nan), np.diag([-1.0, 1, 1, 1])])
    np.testing.assert_array_equal(decomposition.placed(row, poses, 0), poses)


def test_the_stage_undoes_a_nudge_that_the_motions_know(monkeypatch: pytest.MonkeyPatch) -> None:
    """Motions all right but one, which is the one that the poses came from."""
    views, begin = [*blob_views(3)], nearly_right(0.0, 0.0)
    views.append(replace(views[0], name="twin"))
    truth = {**begin.poses, "twin": np.eye(4)}
    wrong = truth[views[1].name] @ nudge(views[1], 5.0, 2.0)
    begin = replace(begin, poses={**truth, views[1].name: wrong})
    edges = []
    for i, one in enumerate(views):
        for j, other in enumerate(views):
            poses = begin.poses if {i, j} == {0, 1} else truth
            if i != j:
                motion = se3.invert(poses[one.name]) @ poses[other.name]
                edges.append(Edge(j, i, motion, 0.8, 1.0))
    monkeypatch.setattr(view_graph, "edges", lambda *_: edges)
    found = LowRankSparse()(begin, views, pipeline())
    for name, pose in truth.items():
        np.testing.assert_allclose(found.poses[name], pose, atol=1e-3)
    assert found.model is None


def test_views_without_a_path_to_the_reference_keep_their_poses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    views, begin = [*blob_views(3)], nearly_right()
    monkeypatch.setattr(view_graph, "edges", lambda *_: [Edge(2, 1, np.eye(4), 0.8, 1.0)])
    assert LowRankSparse()(begin, views, pipeline()) is begin
    motion = se3.from_parts(np.eye(3), np.ones(3))
    monkeypatch.setattr(view_graph, "edges", lambda *_: [Edge(1, 0, motion, 0.8, 1.0)])
    found = LowRankSparse()(begin, views, pipeline())
    last = views[2].name
    assert found.poses[last] is begin.poses[last]
    np.testing.assert_allclose(found.poses[views[1].name], motion, atol=1e-3)


def test_one_way_serves_the_other_way(rng: np.random.Generator) -> None:
    views, motion = list(blob_views(2)), se3.random(rng, 5.0)
    relative, weights = LowRankSparse().blocks(views, [Edge(1, 0, motion, 0.8, 1.0)])
    np.testing.assert_allclose(relative[1, 0] @ motion, np.eye(4), atol=1e-12)
    np.testing.assert_array_equal(weights, [[0, 1], [1, 0]])


def test_weights_fall_with_the_square_of_the_error() -> None:
    views = list(blob_views(3))
    edges = [Edge(1, 0, np.eye(4), 0.8, 1.0), Edge(2, 0, np.eye(4), 0.8, 2.0)]
    np.testing.assert_allclose(LowRankSparse(weighted=True).weights(views, edges), [1, 0.25])
    np.testing.assert_array_equal(LowRankSparse().weights(views, edges), [1, 1])


def test_gaps_are_filled_by_way_of_the_best_view(rng: np.random.Generator) -> None:
    relative = ring(4, 0.0, rng)[1]
    weights = np.array([[0, 1, 0.5, 0], [1, 0, 0, 0.4], [0.5, 0, 0, 1], [0, 0.4, 1, 0]])
    broken = relative.copy()
    broken[0, 2] = broken[2, 0] = np.eye(4)  # the way by view 2 would be wrong, and better
    filled, full = stage.completed(broken, weights)
    np.testing.assert_allclose(filled[0, 3], broken[0, 2] @ broken[2, 3])
    assert full[0, 3] == 0.5
    np.testing.assert_array_equal(full[weights > 0], weights[weights > 0])


def test_points_that_fix_no_pose_measure_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    good = blob_views(3)[0]
    line = plain_view("line", good.points[:1] + np.arange(20.0)[:, None], good.scale)
    asked: list[str] = []

    def none(_: object, views: list[object], *__: object) -> list[Edge]:
        asked.extend(view.name for view in views)  # type: ignore[attr-defined]
        return []

    monkeypatch.setattr(view_graph, "edges", none)
    begin = replace(nearly_right(), poses={good.name: np.eye(4), "line": np.eye(4)})
    assert LowRankSparse()(begin, [good, line], pipeline()) is begin
    assert asked == [good.name]


def test_wrong_parameters_are_refused() -> None:
    with pytest.raises(InputError, match="min_overlap"):
        LowRankSparse(min_overlap=1.0)
