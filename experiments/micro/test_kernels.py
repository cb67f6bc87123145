"""Speed of the compiled kernels, each beside its reference in plain NumPy and SciPy.

References of neighbourhoods look at all points, so that there the kernels are given little to do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from mvreg.geometry import se3
from mvreg.kernels import (
    descriptor_matches,
    descriptors,
    grid,
    icp,
    moments,
    ransac,
    text,
    trimmed_pairs,
)
from mvreg.stages.propagate.consensus import ConsensusPropagate, triples
from mvreg.stages.refine.plane_base import PlaneICP
from mvreg.stages.refine.planes import PointToPlane
from mvreg.testing.reference import descriptors as plain_descriptors
from mvreg.testing.reference import grid as plain_grid
from mvreg.testing.reference import icp as plain_icp
from mvreg.testing.reference import moments as plain_moments
from mvreg.testing.reference import propagate as plain_propagate
from mvreg.testing.reference import text as plain_text
from mvreg.types import Array, Indices, Matches, Scan, View, common_spread

BOTH = pytest.mark.parametrize("variant", ["kernel", "reference"])
#: Keypoints that the references of neighbourhoods are asked about.
FEW = 20
#: Of the trimmed refinement: least overlap, power, iterations, tolerance.
TRIMMED = (0.4, 3.0, 100, 1e-6)
#: Matches of a consensus, the share of them that is right, samples, and how often all that.
MATCHES, RIGHT, SAMPLES, TIMES = 60, 0.5, 200, 20

Call = Callable[[], Any]


def timed(benchmark: Any, variant: str, kernel: Call, reference: Call) -> Any:
    """Measure one of the two, and return what it answers."""
    return benchmark(kernel if variant == "kernel" else reference)


@BOTH
@pytest.mark.benchmark(group="kernel: moments of 20 neighbourhoods, 4 radii")
def test_moments(benchmark: Any, scan: Scan, views: list[View], variant: str) -> None:
    keypoints = views[0].features.keypoints[:FEW]
    radii: Array = np.linspace(0.5, 2, 4) * views[0].scale.spacing
    tree = scan.tree
    count, _, _ = timed(
        benchmark, variant, lambda: moments.moments(tree, keypoints, radii),
        lambda: plain_moments.moments(scan.points, keypoints, radii),
    )  # fmt: skip
    assert count.min() > 0


@BOTH
@pytest.mark.benchmark(group="kernel: 5 nearest descriptors of other scans, each of 2,000")
def test_descriptors(benchmark: Any, variant: str) -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(2000, 14)) * np.geomspace(1, 0.1, 14)
    owners, asking = np.repeat(np.arange(10), 200), np.arange(2000)
    found = timed(
        benchmark, variant, lambda: descriptors.DescriptorTree(rows, owners).foreign(asking, 5),
        lambda: plain_descriptors.foreign(rows, owners, asking, 5)[0],
    )  # fmt: skip
    assert (found >= 0).all()


@BOTH
@pytest.mark.benchmark(group="kernel: normals of 20 points")
def test_normals(benchmark: Any, scan: Scan, views: list[View], variant: str) -> None:
    points, tree = views[0].points[:FEW], scan.tree
    found = timed(
        benchmark, variant, lambda: moments.normals(tree, points, 20),
        lambda: plain_moments.normals(scan.points, points, 20),
    )  # fmt: skip
    assert np.allclose(np.linalg.norm(found, axis=1), 1)


@BOTH
@pytest.mark.benchmark(group="kernel: trimmed pairs")
def test_pairs(benchmark: Any, views: list[View], begin: Array, variant: str) -> None:
    source, target = views
    moved, tree = se3.apply(begin, source.points), target.tree
    found = timed(
        benchmark, variant,
        lambda: trimmed_pairs.trimmed(tree, moved, 4 * source.scale.spacing, *TRIMMED[:2]),
        lambda: plain_icp.trimmed(target.points, moved, *TRIMMED[:2]),
    )  # fmt: skip
    assert len(found[0]) >= 0.4 * len(moved)


@pytest.fixture
def begin(truth: Array) -> Array:
    """A pose (4, 4) that is 5 degrees off."""
    turned: Array = truth @ se3.exp(np.array([0, 0, np.radians(5), 0, 0, 0]))
    return turned


@BOTH
@pytest.mark.benchmark(group="kernel: trimmed ICP, 5 degrees off")
def test_trimmed(
    benchmark: Any, views: list[View], truth: Array, begin: Array, variant: str
) -> None:
    source, target = views
    spacing, tree = source.scale.spacing, target.tree
    found = timed(
        benchmark, variant,
        lambda: icp.trimmed_icp(
            tree, source.points, begin, 4 * spacing, 1e-9 * spacing, *TRIMMED
        ),
        lambda: plain_icp.trimmed_icp(target.points, source.points, begin, *TRIMMED),
    )  # fmt: skip
    assert np.linalg.norm(found[0] - truth) < 1


@BOTH
@pytest.mark.benchmark(group="kernel: point-to-plane ICP, 5 degrees off")
def test_planes(
    benchmark: Any, views: list[View], truth: Array, begin: Array, variant: str
) -> None:
    stage, (source, target) = PointToPlane(), views
    _ = target.tree
    found = timed(
        benchmark, variant, lambda: stage.iterate(source, target, begin),
        lambda: PlaneICP.iterate(stage, source, target, begin),
    )  # fmt: skip
    assert np.linalg.norm(found[0] - truth) < 1


@BOTH
@pytest.mark.benchmark(group="kernel: spread the seeds of a pair")
def test_spread(benchmark: Any, views: list[View], seeds: Matches, variant: str) -> None:
    stage, (source, target) = ConsensusPropagate(), views
    limits = (
        stage.distance_tolerance * source.scale.spacing, np.radians(stage.angle_tolerance),
        stage.descriptor_tolerance * common_spread(source.features, target.features),
    )  # fmt: skip
    pairs = [(int(i), int(j)) for i, j in seeds.indices]
    found = timed(
        benchmark, variant, lambda: stage.spread(source, target, seeds.indices),
        lambda: [plain_propagate.spread(source.features, target.features, pair, *limits)
                 for pair in pairs],
    )  # fmt: skip
    assert max(len(matches) for matches in found) > 20


@BOTH
@pytest.mark.benchmark(group="kernel: nearest descriptors of a pair")
def test_rows(benchmark: Any, views: list[View], variant: str) -> None:
    own, other = (view.features.descriptors for view in views)
    distances, _ = timed(
        benchmark, variant, lambda: descriptor_matches.Rows(other).nearest(own),
        lambda: plain_propagate.nearest_rows(own, other),
    )  # fmt: skip
    assert len(distances) == len(own)


@BOTH
@pytest.mark.benchmark(group="kernel: consensus of 20 times 60 matches, 200 samples")
def test_consensus(benchmark: Any, variant: str) -> None:
    rng, every = np.random.default_rng(0), np.arange(MATCHES)
    source, motion = rng.uniform(-50, 50, (MATCHES, 3)), se3.random(rng, shift=50)
    target = se3.apply(motion, source)
    wrong = rng.random(MATCHES) > RIGHT
    target[wrong] += rng.uniform(-30, 30, (int(wrong.sum()), 3))
    draws = triples([MATCHES] * TIMES, SAMPLES, rng)
    matches, ends = np.tile(np.stack([every, every], axis=1), (TIMES, 1)), np.arange(TIMES + 1)
    found = timed(
        benchmark, variant,
        lambda: ransac.consensus(source, target, matches, ends * MATCHES, draws, 2.0)[0],
        lambda: [plain_consensus(source, target, draw) for draw in draws],
    )  # fmt: skip
    assert np.allclose(found, motion)


def plain_consensus(source: Array, target: Array, draw: Indices) -> Array:
    """The reference's motion (4, 4)."""
    found = plain_propagate.consensus(source, target, draw, 2.0)
    assert found is not None
    return found[0]


@BOTH
@pytest.mark.benchmark(group="kernel: cells of a grid, 30,000 points")
def test_cells(benchmark: Any, scan: Scan, views: list[View], variant: str) -> None:
    step = views[0].scale.spacing
    found = timed(
        benchmark, variant, lambda: grid.Cells(scan.points, step).sizes,
        lambda: plain_grid.cells(scan.points, step)[0],
    )  # fmt: skip
    assert found.sum() == len(scan.points)


@BOTH
@pytest.mark.benchmark(group="kernel: parse a table of 30,000 points")
def test_table(benchmark: Any, scan: Scan, variant: str) -> None:
    count = len(scan.points)
    data = "".join(f"{x:.6g} {y:.6g} {z:.6g}\n" for x, y, z in scan.points.tolist()).encode()
    table, end = timed(
        benchmark, variant, lambda: text.parse_rows(data, 0, count, 3),
        lambda: plain_text.parse_rows(data, 0, count, 3),
    )  # fmt: skip
    assert end == len(data) and np.allclose(table, scan.points, rtol=1e-4, atol=1e-4)
