import numpy as np
from mvreg_comparators.graph import crossing

from mvreg.geometry import se3
from mvreg.types import Edge, ViewGraph


def test_a_join_implies_the_pairs_between_two_trees():
    rng = np.random.default_rng(0)
    world = {name: se3.random(rng, 50.0) for name in "abcde"}

    def edge(source, target):
        return Edge(source, target, se3.invert(world[target]) @ world[source])

    graph = ViewGraph((edge("b", "a"), edge("d", "c"), edge("e", "d")))
    implied = crossing(graph.poses("b"), graph.poses("d"), edge("d", "b"))
    assert set(implied) == {(a, b) for a in "ab" for b in "cde"} - {("b", "d")}
    for (a, b), pose in implied.items():
        np.testing.assert_allclose(pose, se3.invert(world[a]) @ world[b], atol=1e-9)
