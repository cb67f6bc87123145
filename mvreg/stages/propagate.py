"""From seed matches to candidate poses: spread each seed, find a consensus, rank."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg import se3
from mvreg.errors import InputError, check_positive
from mvreg.nearest import nearest
from mvreg.parallel import in_threads
from mvreg.types import Array, Candidates, Indices, Matches, View


def angles_to(normals: Array, index: int, oriented: bool) -> Array:
    """Angles (K, L) in radians between all normals (K, L, 3) and those of one keypoint."""
    cosine = np.einsum("klc,lc->kl", normals, normals[index])
    if not oriented:
        cosine = np.abs(cosine)
    angles: Array = np.arccos(np.clip(cosine, -1, 1))
    return angles


def band_pairs(wanted: Array, have: Array, tolerance: float) -> tuple[Indices, Indices]:
    """All index pairs (i, j) with ``abs(wanted[i] - have[j]) <= tolerance``, grouped by i.

    Sorting makes it O((m + n) log n + pairs), the cost that the paper claims.
    """
    order = np.argsort(have, kind="stable")
    ascending = have[order]
    first = np.searchsorted(ascending, wanted - tolerance, side="left")
    last = np.searchsorted(ascending, wanted + tolerance, side="right")
    count = last - first
    i = np.repeat(np.arange(len(wanted)), count)
    start = np.cumsum(count) - count
    j = order[np.arange(count.sum()) - np.repeat(start - first, count)]
    return i, j


def best_of_each(group: Indices, cost: Array) -> Indices:
    """Positions of the cheapest member of each group."""
    order = np.lexsort((cost, group))
    grouped = group[order]
    fresh = np.ones(len(grouped), dtype=bool)
    fresh[1:] = grouped[1:] != grouped[:-1]
    return order[fresh]


def consensus(
    source: Array, target: Array, tolerance: float, samples: int, rng: np.random.Generator
) -> tuple[Array, Indices] | None:
    """Find the rigid motion that most matches agree with (RANSAC, all samples in one batch).

    Parameters
    ----------
    source, target : (M, 3) arrays
        Matched points.
    tolerance : float
        A match agrees if the motion brings it closer than this (length).
    samples : int
        Number of three-point samples.

    Returns
    -------
    (T_target_source, agreeing) or None
        The motion fitted to the agreeing matches, and which they are; None when no sample has more
        than three.
    """
    # Three different matches a sample: offsets that skip what is already drawn.
    size = len(source)
    draw = rng.integers(0, [size, size - 1, size - 2], size=(samples, 3))
    low = np.minimum(draw[:, 0], draw[:, 1] + (draw[:, 1] >= draw[:, 0]))
    draw[:, 1] += draw[:, 1] >= draw[:, 0]
    high = np.maximum(draw[:, 0], draw[:, 1])
    draw[:, 2] += draw[:, 2] >= low
    draw[:, 2] += draw[:, 2] >= high
    # A sample must be a triangle of some size that keeps its shape, or it fixes no motion.
    here, there = source[draw], target[draw]
    sides = [np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2) for x in (here, there)]
    sound = (np.abs(sides[0] - sides[1]).max(axis=1) < 2 * tolerance) & (
        np.linalg.norm(np.cross(here[:, 1] - here[:, 0], here[:, 2] - here[:, 0]), axis=1)
        > tolerance**2
    )
    if not sound.any():
        return None
    motions = se3.fit(here[sound], there[sound])
    moved = source @ np.swapaxes(motions[:, :3, :3], 1, 2) + motions[:, None, :3, 3]
    agree = ((moved - target) ** 2).sum(axis=2) < tolerance**2
    votes = agree.sum(axis=1)
    best = int(votes.argmax())
    if votes[best] <= 3:
        return None
    agreeing = np.flatnonzero(agree[best])
    return se3.fit(source[agreeing], target[agreeing]), agreeing


@dataclass(frozen=True)
class ConsensusPropagate:
    """Fast correspondence propagation: spread every seed over both shapes, then RANSAC.

    A rigid motion keeps distances and angles: a keypoint of the source corresponds to one of the
    target if both are as far from the seed and their normals turn as much from the seed's, at all
    scales, and their descriptors agree (Sec. 3.2 of the paper). One global sweep a seed, as in the
    authors' published code, not an iterative growth.

    Parameters
    ----------
    distance_tolerance : float
        Difference of the distances to the seed, in units of the keypoints' spacing.
    angle_tolerance : float
        Difference of the angles to the seed's normals, in degrees, at every scale.
    descriptor_tolerance : float
        Largest distance of the descriptors.
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
    """

    distance_tolerance: float = 0.5
    angle_tolerance: float = 10.0
    descriptor_tolerance: float = 0.2
    min_matches: int = 11
    samples: int = 200
    inlier_distance: float = 1.0
    quality_overlap: float = 0.4
    keep: int = 5
    separation: float = 10.0

    def __post_init__(self) -> None:
        check_positive(
            "propagate",
            distance_tolerance=self.distance_tolerance,
            angle_tolerance=self.angle_tolerance,
            descriptor_tolerance=self.descriptor_tolerance,
            inlier_distance=self.inlier_distance,
        )
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
        poses, supports = [], []
        own, other = source.features.keypoints, target.features.keypoints
        tolerance = self.inlier_distance * source.scale.spacing
        spreads = in_threads(lambda ij: self.spread(source, target, *ij), seeds.indices.tolist())
        for spread in spreads:
            if len(spread) < self.min_matches:
                continue
            found = consensus(own[spread[:, 0]], other[spread[:, 1]], tolerance, self.samples, rng)
            if found is not None:
                poses.append(found[0])
                supports.append(spread[found[1]])
        if not poses:
            return Candidates.none()
        return self.rank(source, target, np.stack(poses), supports)

    def spread(self, source: View, target: View, i: int, j: int) -> Indices:
        """Spread the seed (i, j) over both shapes: matches (M, 2), the seed first."""
        own, other = source.features, target.features
        oriented = own.oriented and other.oriented
        distance = np.linalg.norm(own.keypoints - own.keypoints[i], axis=1)
        wanted = np.linalg.norm(other.keypoints - other.keypoints[j], axis=1)
        m, n = band_pairs(wanted, distance, self.distance_tolerance * source.scale.spacing)
        alpha, theta = angles_to(own.normals, i, oriented), angles_to(other.normals, j, oriented)
        limit = np.deg2rad(self.angle_tolerance)
        for scale in range(alpha.shape[1]):  # the first scales empty the list
            close = np.abs(alpha[n, scale] - theta[m, scale]) < limit
            m, n = m[close], n[close]
        cost = np.abs(alpha[n] - theta[m]).mean(axis=1)
        best = best_of_each(m, cost)
        m, n = m[best], n[best]
        apart = np.linalg.norm(own.descriptors[n] - other.descriptors[m], axis=1)
        keep = (apart < self.descriptor_tolerance) & (m != j)
        return np.concatenate([[[i, j]], np.stack([n[keep], m[keep]], axis=1)])

    def rank(self, source: View, target: View, poses: Array, supports: list[Indices]) -> Candidates:
        """Order by quality; keep the best that differ."""
        keypoints = source.features.keypoints
        bound = 3 * source.scale.spacing  # farther is as bad as this: it only ranks
        moved = keypoints @ np.swapaxes(poses[:, :3, :3], 1, 2) + poses[:, None, :3, 3]
        distances, _ = nearest(target.keypoint_tree, moved.reshape(-1, 3), bound)
        squared = np.minimum(distances, bound).reshape(len(poses), -1) ** 2
        share = int(np.ceil(self.quality_overlap * len(keypoints)))
        scores = np.partition(squared, share - 1, axis=1)[:, :share].mean(axis=1)
        kept: list[int] = []
        for index in np.argsort(scores, kind="stable"):
            angles = se3.rotation_angle(poses[kept], poses[index])
            if not (np.rad2deg(angles) < self.separation).any():
                kept.append(int(index))
            if len(kept) == self.keep:
                break
        return Candidates(poses[kept], scores[kept], tuple(supports[k] for k in kept))
