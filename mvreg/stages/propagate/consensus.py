"""From seed matches to candidate poses: propagate each seed, find a consensus, rank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mvreg.errors import InputError, check_positive
from mvreg.geometry import se3
from mvreg.geometry.arrays import Flags
from mvreg.geometry.nearest import nearest
from mvreg.geometry.ragged import ends_of
from mvreg.kernels import propagate as kernels
from mvreg.kernels import ransac
from mvreg.parallel import in_threads, slices
from mvreg.stages.propagate.match_sets import Spread
from mvreg.stages.propagate.upright import as_steep, levelled_poses
from mvreg.types import Array, Candidates, Indices, Matches, View, common_spread

#: So many seeds are worth a thread's while.
PART = 8
#: Poses are ranked on every n-th keypoint first, and so many times those wanted on all.
FEWER, AMONG = 4, 3


def triples(sizes: Sequence[int] | Indices, samples: int, rng: np.random.Generator) -> Indices:
    """Draw three different ones of so many things, again and again: (S, samples, 3)."""
    most = np.asarray(sizes)[:, None, None] - np.arange(3)
    draw = rng.integers(0, most, size=(len(most), samples, 3))
    first, second, third = np.moveaxis(draw, 2, 0)
    # Offsets that skip what is already drawn.
    second += second >= first
    third += third >= np.minimum(first, second)
    third += third >= np.maximum(first, second)
    return draw


def shape(view: View) -> kernels.Shape:
    """A view as the kernel asks for it."""
    features = view.features
    return kernels.Shape(features.keypoints, features.normals, features.descriptors)


@dataclass(frozen=True)
class ConsensusPropagate:
    """Fast correspondence propagation: spread every seed over both shapes, then RANSAC.

    A rigid motion keeps distances and angles: a keypoint of the source corresponds to one of the
    target if both are as far from the seed and their normals turn as much from the seed's, at all
    scales, and their descriptors agree (Sec. 3.2 of the paper). One global sweep a seed, as in the
    authors' published code, not an iterative growth. Between views whose verticals are known, poses
    keep to them.

    Parameters
    ----------
    distance_tolerance : float
        Difference of the distances to the seed, in units of the keypoints' spacing.
    angle_tolerance : float
        Difference of the angles to the seed's normals, in degrees, at every scale.
    descriptor_tolerance : float
        Largest distance of the descriptors, in units of their spread, see
        `mvreg.types.common_spread`.
    spread_over : int
        A seed spreads over so many keypoints of the target at least, and twice as many at most;
        evenly thinned, if there are more, as in a model of many scans.
    min_matches : int
        Seeds that spread to fewer matches are given up (the paper's "more than 10").
    samples : int
        Three-point samples of the RANSAC.
    inlier_distance : float
        In units of the keypoints' spacing.
    quality_overlap : float
        The quality of a pose is the mean squared distance of this share of the source keypoints,
        the best ones, to the target's.
    keep : int
        How many candidates to return. The paper's best one alone stalls or errs in some orders of
        the scans; five complete all that were tried.
    separation : float
        Candidates differ in rotation by more than this, in degrees.
    slide : float
        Or they move the middle of the source's keypoints to places so far apart, in units of the
        keypoints' spacing. Infinite, as in the paper, where only rotations count: of poses that
        differ by a slide along a corridor or a row of windows only the best is kept then.
    """

    distance_tolerance: float = 0.5
    angle_tolerance: float = 10.0
    descriptor_tolerance: float = 1.0
    spread_over: int = 500
    min_matches: int = 11
    samples: int = 200
    inlier_distance: float = 1.0
    quality_overlap: float = 0.4
    keep: int = 5
    separation: float = 10.0
    slide: float = np.inf

    def __post_init__(self) -> None:
        check_positive(
            "propagate",
            distance_tolerance=self.distance_tolerance,
            angle_tolerance=self.angle_tolerance,
            descriptor_tolerance=self.descriptor_tolerance,
            inlier_distance=self.inlier_distance,
            slide=self.slide,
        )
        check_positive("propagate", spread_over=self.spread_over)
        if self.keep < 1 or self.samples < 1 or self.min_matches < 3:
            raise InputError(
                "propagate: expected keep >= 1, samples >= 1 and min_matches >= 3, got "
                f"{self.keep}, {self.samples} and {self.min_matches}"
            )
        if not 0 < self.quality_overlap <= 1:
            raise InputError(
                f"propagate.quality_overlap: expected a share in (0, 1], got {self.quality_overlap}"
            )

    def __call__(
        self, source: View, target: View, seeds: Matches, rng: np.random.Generator
    ) -> Candidates:
        possible = seeds.indices[as_steep(source, target, seeds.indices)]
        if not len(possible):
            return Candidates.none()
        spread = self.spread(source, target, possible).at_least(self.min_matches)
        if not len(spread):
            return Candidates.none()
        poses, agree = self.consensus(source, target, spread, rng)
        found = np.flatnonzero(np.logical_or.reduceat(agree, spread.ends[:-1]))
        poses, level = levelled_poses(source, target, poses)
        found = found[level[found]]
        if not len(found):
            return Candidates.none()
        kept, scores = self.rank(source, target, poses[found])
        chosen = found[kept]
        matches = tuple(spread[k][agree[spread.ends[k] : spread.ends[k + 1]]] for k in chosen)
        return Candidates(poses[chosen], scores, matches)

    def spread(self, source: View, target: View, seeds: Indices) -> Spread:
        """Spread seeds (S, 2), at least one, over both shapes."""
        own, other = shape(source), shape(target)
        step = max(1, len(target.features.keypoints) // self.spread_over)
        oriented = source.features.oriented and target.features.oriented
        alike = self.descriptor_tolerance * common_spread(source.features, target.features)
        parts = in_threads(
            lambda part: kernels.spread(
                own, other, seeds[part], oriented, self.distance_tolerance * source.scale.spacing,
                np.deg2rad(self.angle_tolerance), alike, step,
            ),
            slices(len(seeds), PART),
        )  # fmt: skip
        sizes = np.concatenate([np.diff(ends) for _, ends in parts])
        matches = np.concatenate([matches for matches, _ in parts])
        return Spread(matches, ends_of(sizes)).only(as_steep(source, target, matches))

    def consensus(
        self, source: View, target: View, spread: Spread, rng: np.random.Generator
    ) -> tuple[Array, Flags]:
        """The motions (S, 4, 4) that the sets' matches agree on, and which agree (M,)."""
        draws = triples(spread.sizes, self.samples, rng)
        own, other = source.features.keypoints, target.features.keypoints
        tolerance = self.inlier_distance * source.scale.spacing

        def of_some(some: slice) -> tuple[Array, Flags]:
            part = spread.part(some)
            poses, agree = ransac.consensus(
                own, other, part.matches, part.ends, draws[some], tolerance
            )
            return poses, agree

        found = in_threads(of_some, slices(len(spread), PART))
        return np.concatenate([p for p, _ in found]), np.concatenate([a for _, a in found])

    def rank(self, source: View, target: View, poses: Array) -> tuple[Indices, Array]:
        """Which poses differ and have the best quality, and that: best first."""
        keypoints = source.features.keypoints
        rough = self.quality(keypoints[::FEWER], source, target, poses)
        middle = keypoints.mean(axis=0)
        places = poses[:, :3, :3] @ middle + poses[:, :3, 3]
        few = self.different(poses, places / source.scale.spacing, rough, AMONG * self.keep)
        scores = self.quality(keypoints, source, target, poses[few])
        kept = np.argsort(scores, kind="stable")[: self.keep]
        return few[kept], scores[kept]

    def different(self, poses: Array, places: Array, scores: Array, most: int) -> Indices:
        """Positions of the best poses that differ, `most` of them.

        `places` (C, 3) are where they put the middle of the source, in spacings of the keypoints.
        """
        kept: list[int] = []
        left = np.argsort(scores, kind="stable")
        while len(left) and len(kept) < most:
            kept.append(int(left[0]))
            angles = se3.rotation_angle(poses[left], poses[left[0]])
            turned = np.rad2deg(angles[1:]) >= self.separation
            slid = np.linalg.norm(places[left[1:]] - places[left[0]], axis=1) >= self.slide
            left = left[1:][turned | slid]
        return np.array(kept)

    def quality(self, keypoints: Array, source: View, target: View, poses: Array) -> Array:
        """Mean squared distances (C,) of the best of the keypoints, moved, to the target's."""
        bound = 3 * source.scale.spacing  # farther is as bad as this: it only ranks
        moved = keypoints @ np.swapaxes(poses[:, :3, :3], 1, 2) + poses[:, None, :3, 3]
        distances, _ = nearest(target.keypoint_tree, moved.reshape(-1, 3), bound)
        squared = np.minimum(distances, bound).reshape(len(poses), -1) ** 2
        share = int(np.ceil(self.quality_overlap * len(keypoints)))
        scores: Array = np.partition(squared, share - 1, axis=1)[:, :share].mean(axis=1)
        return scores
