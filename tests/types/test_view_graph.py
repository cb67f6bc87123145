"""Traversal of the view graph, on which judges, strategies, adjustments and plugins rely."""

from dataclasses import replace

import numpy as np
import pytest

from mvreg.errors import InputError
from mvreg.geometry import se3
from mvreg.testing import blob_views
from mvreg.testing.views import registration
from mvreg.types import Edge, Model, Part, ViewGraph
from mvreg.types.view_graph import breadth_first, reachable

WORLD = dict(
    zip("abcdefg", [se3.random(np.random.default_rng(k), 50.0) for k in range(7)], strict=True)
)


def edge(source, target, spoilt=None, cost=0.0):
    pose = se3.invert(WORLD[target]) @ WORLD[source]
    return Edge(source, target, pose if spoilt is None else pose @ spoilt, cost=cost)


def graph(*pairs):
    return ViewGraph(tuple(edge(*pair) for pair in pairs))


def test_breadth_first_comes_to_the_nearest_first():
    ways = {0: [1, 2], 1: [3], 2: [3, 0], 3: [4]}
    assert breadth_first(0, ways) == {0: None, 1: 0, 2: 0, 3: 1, 4: 3}
    assert breadth_first(9, ways) == {9: None}
    assert reachable([(0, 1), (2, 1), (3, 4)], 0) == {0, 1, 2}


def test_poses_follow_edges_either_way_and_leave_out_what_is_not_reached():
    found = graph("ba", "bc", "ed").poses("a")
    assert list(found) == ["a", "b", "c"]
    for name, pose in found.items():
        np.testing.assert_allclose(pose, se3.invert(WORLD["a"]) @ WORLD[name], atol=1e-9)


def test_the_shortest_way_counts():
    spoilt = ViewGraph((edge("b", "a"), edge("c", "b", se3.random(np.random.default_rng(9), 1.0)),
                        edge("c", "a")))  # fmt: skip
    np.testing.assert_allclose(
        spoilt.poses("a")["c"], se3.invert(WORLD["a"]) @ WORLD["c"], atol=1e-9
    )
    assert spoilt.path("a", "c").steps == 1


@pytest.mark.parametrize(("start", "end"), ["ac", "ca", "ad", "da", "aa"])
def test_a_path_has_the_motion_and_the_number_of_its_edges(start, end):
    found = graph("ba", "bc", "dc").path(start, end)
    assert found.steps == abs(ord(start) - ord(end))
    np.testing.assert_allclose(found.motion, se3.invert(WORLD[end]) @ WORLD[start], atol=1e-9)


def test_where_no_way_leads_there_is_none():
    assert graph("ba").path("a", "d") is None
    assert graph("ba").path("d", "d") is None, "d is not in the graph"
    assert ViewGraph().path("a", "a") is None


def test_a_graph_is_changed_by_making_another():
    first = graph("ba", "cb")
    more = first.with_edge(edge("d", "c"))
    assert (len(first), len(more)) == (2, 3)
    assert more.component("a") == ["a", "b", "c", "d"]
    assert more.without({"b"}).component("a") == ["a"]
    assert [(e.source, e.target) for e in more.without({"b"})] == [("d", "c")]


def test_a_merged_model_is_reached_by_way_of_any_of_its_views():
    source, first, second = blob_views()
    part = se3.exp(np.array([0, 0, 0.3, 1.0, 2.0, 3.0]))
    model = replace(Model.of(first), parts=(Part(first, np.eye(4)), Part(second, part)))
    step = se3.exp(np.array([0, 0.2, 0, 0.0, 1.0, 0.0]))
    loop = ViewGraph((Edge(source.name, second.name, step),)).loop(source, model)
    assert loop.steps == 1
    np.testing.assert_allclose(loop.motion, part @ step)
    assert ViewGraph().loop(source, model) is None
    found = Edge.of(registration(source, model, step), source, model)
    assert (found.source, found.target) == (source.name, first.name)


def test_names_mean_nothing():
    first, second, third = (
        replace(v, name=n) for v, n in zip(blob_views(), ["model", "", "0"], strict=True)
    )
    model = Model.of(first)
    found = ViewGraph().with_edge(Edge.of(registration(second, model, np.eye(4)), second, model))
    assert found.component("model") == ["model", ""]
    assert found.loop(third, model) is None
    assert found.loop(second, model).steps == 1


def test_the_spanning_tree_takes_the_cheapest_edges():
    costs = {"ba": 1.0, "cb": 2.0, "ca": 3.0, "dc": 4.0, "db": 0.5, "fe": 0.1}
    whole = ViewGraph(tuple(edge(*pair, cost=cost) for pair, cost in costs.items()))
    tree = whole.spanning_tree("a")
    assert ["".join((e.source, e.target)) for e in tree] == ["ba", "db", "cb"]
    assert len(whole.spanning_tree("g")) == 0
    with pytest.raises(InputError, match="NaN"):
        ViewGraph((edge("b", "a", cost=float("nan")),)).spanning_tree("a")
