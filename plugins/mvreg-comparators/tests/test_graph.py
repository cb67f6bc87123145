import numpy as np
from mvreg_comparators.graph import Edge, crossing, poses_from

from mvreg.geometry import se3


def truth(count=5):
    rng = np.random.default_rng(0)
    return [se3.random(rng, 50.0) for _ in range(count)]


def edge(poses, source, target, cost=1.0):
    return Edge(source, target, se3.invert(poses[target]) @ poses[source], cost)


def test_poses_follow_edges_either_way_and_leave_out_what_is_not_reached():
    world = truth()
    edges = [edge(world, 1, 0), edge(world, 1, 2), edge(world, 4, 3)]
    found = poses_from(0, edges)
    assert list(found) == [0, 1, 2]
    for index, pose in found.items():
        np.testing.assert_allclose(pose, se3.invert(world[0]) @ world[index], atol=1e-9)
    assert list(poses_from(3, edges)) == [3, 4]


def test_the_shortest_way_counts():
    world = truth()
    bent = edge([world[0], world[1], world[4], world[3]], 2, 1)  # places 2 where 4 is
    found = poses_from(0, [edge(world, 1, 0), bent, edge(world, 2, 0)])
    np.testing.assert_allclose(found[2], se3.invert(world[0]) @ world[2], atol=1e-9)


def test_a_join_implies_the_pairs_between_two_trees():
    world = truth()
    edges = [edge(world, 1, 0), edge(world, 3, 2), edge(world, 4, 3)]
    joining = edge(world, 3, 1)
    implied = crossing(poses_from(1, edges), poses_from(3, edges), joining)
    assert set(implied) == {(a, b) for a in (0, 1) for b in (2, 3, 4)} - {(1, 3)}
    for (a, b), pose in implied.items():
        np.testing.assert_allclose(pose, se3.invert(world[a]) @ world[b], atol=1e-9)
