"""A pair of clouds by Open3D: FPFH, a global registration, point-to-plane ICP twice."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

import mvreg
from mvreg.types import Array, Verdict
from mvreg_peers.clouds import Cloud
from mvreg_peers.graph import Attempt

# Open3D's tutorials "Global registration" and "Multiway registration", in voxels.
NORMALS, NORMALS_MOST = 2.0, 30
FEATURES, FEATURES_MOST = 5.0, 100
FGR_REACH = 0.5
RANSAC_REACH, RANSAC_EDGE, RANSAC_TRIALS, RANSAC_CONFIDENCE = 1.5, 0.9, 100_000, 0.999
COARSE, FINE = 1.5, 0.4
#: Fast global registration answers with the identity where it has fewer matches.
FEWEST = 10

#: Open3D has one random generator for all threads: seeding and drawing must stay together.
_RANDOM = threading.Lock()


class Matcher(Enum):
    """What turns FPFH matches into a pose: fast global registration, or RANSAC."""

    fgr = "fgr"
    ransac = "ransac"


@dataclass(frozen=True, eq=False)
class Prepared:
    """A cloud as Open3D wants it: all points, one per voxel, and the features of the latter."""

    fine: Any
    coarse: Any
    features: Any

    @property
    def sizes(self) -> tuple[int, int]:
        """How many points there are, one per voxel and in all."""
        return len(self.coarse.points), len(self.fine.points)


def prepare(clouds: Sequence[Cloud], voxel: float) -> list[Prepared]:
    """Thin out, estimate normals, describe. `voxel` is in resolutions."""
    open3d = mvreg.load_open3d()
    hybrid = open3d.geometry.KDTreeSearchParamHybrid
    describe = open3d.pipelines.registration.compute_fpfh_feature
    made = []
    for cloud in clouds:
        fine = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(cloud.points))
        coarse = fine.voxel_down_sample(voxel) if len(cloud.points) else fine
        features = None
        if len(coarse.points) >= FEWEST:
            # The finer cloud is matched within FINE voxels, so it has voxels of that size.
            fine.estimate_normals(hybrid(NORMALS * FINE * voxel, NORMALS_MOST))
            coarse.estimate_normals(hybrid(NORMALS * voxel, NORMALS_MOST))
            features = describe(coarse, hybrid(FEATURES * voxel, FEATURES_MOST))
        made.append(Prepared(fine, coarse, features))
    return made


@dataclass(frozen=True)
class PairByFpfh:
    """Registers one prepared cloud to another; lengths are in resolutions."""

    voxel: float
    matcher: Matcher
    min_fitness: float

    def __call__(
        self, number: tuple[int, int], source: Prepared, target: Prepared, seed: int
    ) -> Attempt:
        if min(*source.sizes, *target.sizes) < FEWEST:
            return Attempt(*number, self._verdict(0.0, "too few points"))
        with _RANDOM:
            start = time.perf_counter()  # waiting for the lock is no work
            coarse = self._match(source, target, seed)
        seconds = {"propagate": time.perf_counter() - start}
        if np.trace(coarse) == 4.0:  # the identity, to the last bit: it found nothing
            return Attempt(*number, self._verdict(0.0, "no candidate pose"), seconds=seconds)
        edge = self._refine(number, source, target, coarse)
        seconds["refine"] = time.perf_counter() - start - seconds["propagate"]
        return Attempt(
            *number, edge.verdict, coarse, edge.pose, edge.quality, edge.information,
            seconds=seconds,
        )  # fmt: skip

    def _match(self, source: Prepared, target: Prepared, seed: int) -> Array:
        """``T_target_source`` (4, 4) by features alone."""
        open3d = mvreg.load_open3d()
        reg = open3d.pipelines.registration
        open3d.utility.random.seed(seed)
        clouds = source.coarse, target.coarse, source.features, target.features
        if self.matcher is Matcher.fgr:
            option = reg.FastGlobalRegistrationOption(
                maximum_correspondence_distance=FGR_REACH * self.voxel
            )
            found = reg.registration_fgr_based_on_feature_matching(*clouds, option)
        else:
            reach = RANSAC_REACH * self.voxel
            found = reg.registration_ransac_based_on_feature_matching(
                *clouds, True, reach, reg.TransformationEstimationPointToPoint(False), 3,
                [reg.CorrespondenceCheckerBasedOnEdgeLength(RANSAC_EDGE),
                 reg.CorrespondenceCheckerBasedOnDistance(reach)],
                reg.RANSACConvergenceCriteria(RANSAC_TRIALS, RANSAC_CONFIDENCE),
            )  # fmt: skip
        return np.array(found.transformation)

    def _refine(
        self, number: tuple[int, int], source: Prepared, target: Prepared, pose: Array
    ) -> Attempt:
        """ICP on the voxels, and if these fit, on all points."""
        reg = mvreg.load_open3d().pipelines.registration
        plane = reg.TransformationEstimationPointToPlane()
        verdict, fitness, information = self._verdict(0.0, ""), 0.0, None
        for level, reach in (("coarse", COARSE * self.voxel), ("fine", FINE * self.voxel)):
            clouds = getattr(source, level), getattr(target, level)
            pose = reg.registration_icp(*clouds, reach, pose, plane).transformation
            information = reg.get_information_matrix_from_point_clouds(*clouds, reach, pose)
            fitness = information[5, 5] / min(len(cloud.points) for cloud in clouds)
            verdict = self._verdict(fitness, f"fitness of the {level} cloud {fitness:.2f}")
            if not verdict.reliable:
                break
        return Attempt(*number, verdict, None, np.array(pose), fitness, information)

    def _verdict(self, fitness: float, reason: str) -> Verdict:
        """Enough of the smaller cloud must have met the other."""
        reliable = fitness >= self.min_fitness
        return Verdict(reliable, 1 - min(fitness, 1.0), 1 - self.min_fitness, reason)
