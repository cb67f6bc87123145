"""Speed of what is asked of single scans: neighbours, normals, moments, thinning, reading."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, mean_spacing, nearest
from mvreg.io.points import read_points
from mvreg.stages.describe.spectrum import neighbourhood_moments
from mvreg.stages.downsample.voxels import surface_centroids, voxel_centroids
from mvreg.surface.normals import Orient, estimate_normals
from mvreg.types import Array, Scan, View

#: A cell of the grids, in resolutions of the scan.
CELL = 6.0


def build_with_scipy(points: Array) -> Any:
    """The tree that was used before there were kernels."""
    return cKDTree(points, balanced_tree=False, compact_nodes=False)


def ask_scipy(tree: Any, queries: Array, bound: float = np.inf) -> Any:
    """As `nearest`."""
    return tree.query(queries, distance_upper_bound=bound, workers=-1)


BUILDERS = pytest.mark.parametrize("build", [build_tree, build_with_scipy], ids=["mvreg", "scipy"])
TREES = pytest.mark.parametrize(
    ("build", "ask"), [(build_tree, nearest), (build_with_scipy, ask_scipy)], ids=["mvreg", "scipy"]
)


@BUILDERS
@pytest.mark.benchmark(group="build a tree, 30,000 points")
def test_build(benchmark: Any, scan: Scan, build: Callable[[Array], Any]) -> None:
    assert benchmark(build, scan.points).n == len(scan.points)


@TREES
@pytest.mark.benchmark(group="nearest, aligned within a bound")
def test_aligned(
    benchmark: Any, views: list[View], truth: Array, build: Any, ask: Callable[..., Any]
) -> None:
    source, target = views
    tree = build(target.points)
    moved = se3.apply(truth, source.points)
    distances, _ = benchmark(ask, tree, moved, 3 * target.resolution)
    assert np.isfinite(distances).mean() > 0.3


@TREES
@pytest.mark.benchmark(group="nearest, misaligned and unbounded")
def test_misaligned(benchmark: Any, views: list[View], build: Any, ask: Callable[..., Any]) -> None:
    source, target = views
    tree = build(target.points)
    moved = source.points + np.ptp(target.points, axis=0)
    distances, _ = benchmark(ask, tree, moved)
    assert np.isfinite(distances).all()


@pytest.mark.benchmark(group="mean spacing, 30,000 points")
def test_spacing(benchmark: Any, scan: Scan) -> None:
    assert benchmark(mean_spacing, scan.points) > 0


@pytest.mark.benchmark(group="normals, 3,500 points of 30,000")
def test_normals(benchmark: Any, scan: Scan, views: list[View]) -> None:
    _ = scan.tree
    found = benchmark(estimate_normals, scan, views[0].points, Orient.auto)
    assert np.allclose(np.linalg.norm(found, axis=1), 1)


@pytest.mark.benchmark(group="moments, 4 radii")
def test_moments(benchmark: Any, scan: Scan, views: list[View]) -> None:
    _ = scan.tree
    radii: Array = np.linspace(0.5, 2, 4) * views[0].scale.spacing
    count, _, _ = benchmark(neighbourhood_moments, scan, views[0].features.keypoints, radii)
    assert count.min() > 0


@pytest.mark.parametrize("thin", [voxel_centroids, surface_centroids])
@pytest.mark.benchmark(group="grid centroids, 30,000 points")
def test_centroids(benchmark: Any, scan: Scan, thin: Callable[[Array, float], Array]) -> None:
    found = benchmark(thin, scan.points, CELL * mean_spacing(scan.points))
    assert 100 < len(found) < len(scan.points) / 5


@pytest.fixture
def table(scan: Scan, tmp_path: Path) -> Path:
    """A scan as the Stanford scanners' software writes it, with two more columns."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(scan.points)}"]
    columns = ("x", "y", "z", "confidence", "intensity")
    head += [*(f"property float {name}" for name in columns), "end_header"]
    file = tmp_path / "scan.ply"
    rows = np.column_stack([scan.points, np.full((len(scan.points), 2), 0.5)])
    np.savetxt(file, rows, fmt="%.6g", header="\n".join(head), comments="")
    return file


@pytest.mark.benchmark(group="read an ASCII file, 30,000 points")
def test_read(benchmark: Any, scan: Scan, table: Path) -> None:
    assert len(benchmark(read_points, table)) == len(scan.points)
