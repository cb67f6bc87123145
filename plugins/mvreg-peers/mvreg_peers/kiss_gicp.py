"""KISS-Matcher and GICP over all pairs, and a spanning tree."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from mvreg.contracts import Pipeline
from mvreg.errors import InputError, PluginError, check_positive
from mvreg.geometry import se3
from mvreg.tbb import copies_of_tbb, one_thread
from mvreg.types import Array, Result, Verdict, View
from mvreg_peers.clouds import Cloud, clouds_of
from mvreg_peers.graph import Attempt, spanning_tree
from mvreg_peers.pairs import all_pairs, placed

#: KISS-Matcher's default voxel. It is made for metres and streets, refuses voxels below 0.005 and
#: clamps noise bounds at 1, so the scans are scaled to have just this voxel.
VOXEL = 0.3
#: Clouds with fewer points are not tried: KISS-Matcher's features need neighbours.
FEWEST = 10
#: GICP twice: its sampling, in voxels and in resolutions, and how far it looks, in samplings.
#: 4 is small_gicp's default (0.25 and 1.0); at last only neighbours count.
COARSE, COARSE_REACH = 0.5, 4.0
FINE, FINE_REACH = 1.0, 2.0


def load() -> tuple[ModuleType, ModuleType]:
    """Import kiss_matcher and small_gicp.

    Raises
    ------
    PluginError
        Where one of them is missing; says what to install.
    """
    try:
        return import_module("kiss_matcher"), import_module("small_gicp")
    except ImportError as error:
        raise PluginError(
            f"strategy=kiss_gicp needs KISS-Matcher and small_gicp, but {error}; install both: "
            "pip install 'mvreg-peers[kiss]'"
        ) from error


@dataclass(frozen=True, eq=False)
class Prepared:
    """A cloud as the two libraries want it; None for one that is too small.

    `metres` (N, 3) is for KISS-Matcher; `coarse` and `fine` are small_gicp's point clouds with
    covariances, and their trees.
    """

    metres: Any
    coarse: Any
    fine: Any


@dataclass(frozen=True)
class KissGicpStrategy:
    """KISS-Matcher over all pairs, GICP, and the maximum spanning tree.

    KISS-Matcher (Lim et al., ICRA 2025): Faster-PFH, k-core outlier pruning, a graduated
    non-convexity solver, all at its published defaults, with the scans scaled to its default voxel
    of 0.3. Then generalized ICP (Segal, Haehnel and Thrun, RSS 2009) from small_gicp (Koide, JOSS
    2024), on half a voxel and then on one resolution. The poses are those along the maximum
    spanning tree by the share of the smaller scan that GICP pairs at last.

    A pair is no edge where KISS-Matcher has fewer final inliers than its own examples ask for, or
    where GICP pairs too little. Scans that no edge connects to the first one are unregistered. No
    judge of mvreg's is asked: this measures KISS-Matcher.

    Repeatable to the last bit: see `mvreg.tbb`; GICP runs on one thread.

    Parameters
    ----------
    voxel : float
        In resolutions of the raw scans.
    min_inliers : int
        Least number of KISS-Matcher's final inliers; 5 in its examples.
    min_overlap : float
        Least share of the smaller scan that GICP must pair; 0.3, as in Open3D's reconstruction
        system. KISS-Matcher's own asks for 0.9, of whole submaps.
    max_iterations : int
        Of GICP, each time; small_gicp's 20.
    """

    voxel: float = 5.0
    min_inliers: int = 5
    min_overlap: float = 0.3
    max_iterations: int = 20

    def __post_init__(self) -> None:
        check_positive("strategy", voxel=self.voxel, max_iterations=self.max_iterations)
        if not 0 < self.min_overlap <= 1:
            raise InputError(
                f"strategy.min_overlap: expected a share in (0, 1], got {self.min_overlap}"
            )

    def __call__(
        self, views: Sequence[View], pipeline: Pipeline, rng: np.random.Generator
    ) -> Result:
        kiss, gicp = load()
        pipeline.begin(views[0])
        clouds = clouds_of(views)
        with one_thread(*copies_of_tbb(kiss)):
            ready = [self._prepared(cloud, gicp) for cloud in clouds]

            def attempt(source: int, target: int) -> Attempt:
                ends = ready[source], ready[target]
                return self._pair((source, target), *ends, kiss, gicp)

            # Both libraries hold Python's lock, so that threads would only wait.
            edges, pairs = all_pairs(views, clouds, pipeline, attempt, threads=1)
        return placed(views, clouds, spanning_tree(edges, 0), pairs, pipeline)

    def _prepared(self, cloud: Cloud, gicp: ModuleType) -> Prepared | None:
        """Scale, thin out, estimate covariances."""
        if len(cloud.points) < FEWEST:
            return None
        coarse = gicp.preprocess_points(cloud.points, COARSE * self.voxel)
        if coarse[0].size() < FEWEST:
            return None
        metres = (cloud.points * (VOXEL / self.voxel)).astype(np.float32)
        return Prepared(metres, coarse, gicp.preprocess_points(cloud.points, FINE))

    def _pair(
        self,
        number: tuple[int, int],
        source: Prepared | None,
        target: Prepared | None,
        kiss: ModuleType,
        gicp: ModuleType,
    ) -> Attempt:
        """Match, then refine what was matched."""
        if source is None or target is None:
            return Attempt(*number, self._verdict(0.0, "too few points"))
        start = time.perf_counter()
        matcher = kiss.KISSMatcher(kiss.KISSMatcherConfig(VOXEL))
        solution = matcher.estimate(source.metres, target.metres)
        seconds = {"propagate": time.perf_counter() - start}
        inliers = matcher.get_num_final_inliers()
        if not solution.valid or inliers < self.min_inliers:
            reason = f"{inliers} inliers of KISS-Matcher"
            return Attempt(*number, self._verdict(0.0, reason), seconds=seconds)
        shift = np.asarray(solution.translation, dtype=float) * (self.voxel / VOXEL)
        coarse = se3.from_parts(np.asarray(solution.rotation, dtype=float), shift)
        edge = self._refined(number, (source, target), coarse, gicp)
        seconds["refine"] = time.perf_counter() - start - seconds["propagate"]
        return Attempt(
            *number, edge.verdict, coarse, edge.pose, edge.quality, None, edge.iterations,
            edge.converged, seconds,
        )  # fmt: skip

    def _refined(
        self, number: tuple[int, int], ends: tuple[Prepared, Prepared], pose: Array,
        gicp: ModuleType,
    ) -> Attempt:  # fmt: skip
        """GICP on few points, and if these fit, on more."""
        verdict, overlap, iterations, converged = self._verdict(0.0, ""), 0.0, 0, False
        reaches = {"coarse": COARSE_REACH * COARSE * self.voxel, "fine": FINE_REACH * FINE}
        for level, reach in reaches.items():
            (moving, _), (fixed, tree) = (getattr(end, level) for end in ends)
            found = gicp.align(
                fixed, moving, tree, pose, registration_type="GICP", num_threads=1,
                max_correspondence_distance=reach, max_iterations=self.max_iterations,
            )  # fmt: skip
            pose, converged = np.array(found.T_target_source), bool(found.converged)
            iterations += int(found.iterations)
            overlap = found.num_inliers / min(moving.size(), fixed.size())
            verdict = self._verdict(overlap, f"GICP pairs {overlap:.2f} of the {level} cloud")
            if not verdict.reliable:
                break
        return Attempt(*number, verdict, None, pose, overlap, None, iterations, converged)

    def _verdict(self, overlap: float, reason: str) -> Verdict:
        """Enough of the smaller cloud must be paired."""
        reliable = overlap >= self.min_overlap
        return Verdict(reliable, 1 - min(overlap, 1.0), 1 - self.min_overlap, reason)
