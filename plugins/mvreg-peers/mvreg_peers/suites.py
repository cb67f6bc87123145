"""The contract suite of strategies that work on raw scans, without keypoints."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from mvreg.testing import StrategyContract, blob_views, pipeline
from mvreg_peers.kiss_gicp import KissGicpStrategy
from mvreg_peers.open3d_multiway import Open3dMultiwayStrategy


class RawScansContract(StrategyContract):
    """As the suite's, but the view that cannot be placed lacks points.

    The suite's own lacks keypoints only, and has the points of the first view: a peer that needs no
    keypoints places it, and rightly. Nothing is waived.
    """

    def examples(self) -> dict[str, tuple[Any, ...]]:
        """The suite's, with three points for the view that cannot be placed."""
        views = blob_views(3)
        first = views[0]
        bare = replace(
            first, name="bare", points=first.points[:3], normals=first.normals[:3], resolution=0.0,
            scan=None,
        )  # fmt: skip
        return {
            "three views": (list(views), pipeline()),
            "one has no keypoints": ([*views[:2], bare], pipeline()),
        }


class KissGicpSuite(RawScansContract):
    """KISS-Matcher with GICP, for scans of few points."""

    stage = KissGicpStrategy(voxel=2.5)


class Open3dMultiwaySuite(RawScansContract):
    """Open3D's multiway registration, for scans of few points."""

    stage = Open3dMultiwayStrategy(voxel=2.5)
