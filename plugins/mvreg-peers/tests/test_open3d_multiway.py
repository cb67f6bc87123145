from pathlib import Path

import numpy as np
import pytest
from mvreg_peers.fpfh import Matcher
from mvreg_peers.graph import Attempt
from mvreg_peers.open3d_multiway import Open3dMultiwayStrategy
from peer_cases import PeerContract, assert_repeatable, bunny, errors_of

import mvreg
from mvreg.geometry import se3
from mvreg.types import Array, Verdict


class TestOpen3dMultiway(PeerContract):
    stage = Open3dMultiwayStrategy(voxel=2.5)  # for scans of few points
    library = "open3d"


def test_fgr_says_the_same_twice_in_threads():
    suite = TestOpen3dMultiway()
    stage = Open3dMultiwayStrategy(voxel=2.5, matcher=Matcher.fgr)
    arguments = suite.examples()["three views"]
    first, second = (suite.call(*arguments, stage=stage) for _ in range(2))
    assert suite.essence(first) == suite.essence(second)
    assert suite.misplaced(first, arguments[0]) < suite.sampled


def ring(count: int = 5) -> list[Array]:
    """Poses ``T_world_cloud`` around a turntable."""
    rng = np.random.default_rng(4)
    return [np.eye(4), *(se3.random(rng, 20.0) for _ in range(count - 1))]


def edge(poses: list[Array], source: int, target: int, off: Array | None = None) -> Attempt:
    """An exact edge, or one that is off."""
    pose = se3.invert(poses[target]) @ poses[source] @ (np.eye(4) if off is None else off)
    quality = 1.0 if off is None else 0.5
    information = 1000 * np.diag([400.0, 400, 400, 1, 1, 1])
    return Attempt(source, target, Verdict(True, 0, 1, ""), None, pose, quality, information)


def test_a_wrong_edge_among_right_ones_is_pruned():
    poses = ring()
    wrong = se3.random(np.random.default_rng(8), 30.0)
    edges = [edge(poses, i, (i + 1) % 5) for i in range(5)]
    edges += [edge(poses, i, (i + 2) % 5) for i in range(4)] + [edge(poses, 4, 1, wrong)]
    found = Open3dMultiwayStrategy()._optimised(dict(enumerate(ring())), edges)
    assert list(found) == [0, 1, 2, 3, 4]
    for index, pose in enumerate(poses):
        np.testing.assert_allclose(found[index], pose, atol=1e-3)


def test_small_errors_are_spread_over_the_loop():
    """Poses along a tree close no loop; the optimisation brings the far end nearer."""
    poses = ring()
    drift = se3.from_parts(np.eye(3), np.array([0.2, 0.0, 0.0]))
    edges = [edge(poses, i + 1, i) for i in range(4)]
    edges = [Attempt(e.source, e.target, e.verdict, None, e.pose @ drift, 1.0, e.information)
             for e in edges] + [edge(poses, 0, 4)]  # fmt: skip
    start = {0: np.eye(4)}
    for e in edges[:4]:
        start[e.source] = start[e.target] @ e.pose
    found = Open3dMultiwayStrategy()._optimised(start, edges)
    before, after = (np.linalg.norm(p[4][:3, 3] - poses[4][:3, 3]) for p in (start, found))
    assert after < 0.6 * before


def test_the_preset_is_the_strategy_as_it_comes():
    method = mvreg.load_method("open3d_multiway")
    assert method.name == "open3d_multiway"
    assert method.strategy == Open3dMultiwayStrategy()
    assert type(method.pipeline.describe).__name__ == "NoDescribe"
    changed = mvreg.load_method("open3d_multiway", {"strategy.matcher": "fgr"})
    assert changed.strategy.matcher is Matcher.fgr


@pytest.mark.parametrize(
    "wrong",
    [{"voxel": 0}, {"min_fitness": 1.5}, {"min_fitness": 0}, {"edge_prune_threshold": -1},
     {"preference_loop_closure": 0}],
)  # fmt: skip
def test_parameters_out_of_range_are_refused(wrong):
    with pytest.raises(mvreg.InputError, match=rf"strategy\.{next(iter(wrong))}: expected"):
        Open3dMultiwayStrategy(**wrong)


@pytest.mark.slow
@pytest.mark.parametrize("matcher", ["fgr", "ransac"])
def test_bunny_shuffled_and_scrambled(data_root: Path, matcher: str):
    scans = bunny(data_root)
    result = mvreg.register(scans, "open3d_multiway", 1, {"strategy.matcher": matcher})
    errors = errors_of(result, scans)
    assert errors.mean.rotation <= 0.0100
    assert errors.mean.translation <= 1.0


@pytest.mark.slow
def test_bunny_is_the_same_twice(data_root: Path, monkeypatch: pytest.MonkeyPatch):
    assert_repeatable(bunny(data_root), "open3d_multiway", monkeypatch)
