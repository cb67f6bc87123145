"""Answers of stages that cannot be right, by kind: what is changed, and what is said of it."""

from dataclasses import replace

import numpy as np

from mvreg.geometry import se3
from mvreg.types import Features, Matches, Sample

NAN = np.full((4, 4), np.nan)
SCALED = np.diag([1.001, 1.001, 1.001, 1.0])
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])


def posed(pose):
    """A change of every pose of a result but the reference's."""
    return lambda new, result, *rest: replace(
        new, poses={k: v if k == new.reference else pose for k, v in new.poses.items()}
    )


def renamed(result):
    """The result with one scan under another name."""
    *others, last = result.poses
    return {**{name: result.poses[name] for name in others}, f"{last}'": result.poses[last]}


WRONG = {
    "adjust": [
        (posed(NAN), r"Result.poses\['blob_\d'\]: expected finite numbers, got nan at \(0, 0\)"),
        (posed(SCALED), "expected a rigid motion, got a matrix whose R.T R is 0.00[56]"),
        (posed(MIRROR), r"expected a rotation, got a reflection \(determinant -1\)"),
        (posed(np.eye(3)), r"expected shape \(4, 4\), got \(3, 3\)"),
        (lambda new, *_: replace(new, poses=renamed(new)), r"poses of .*\"blob_\d'\".* were of"),
        (lambda new, *_: replace(new, poses={k: se3.from_parts(np.eye(3), np.ones(3)) @ v
                                             for k, v in new.poses.items()}),
         "got another pose of 'blob_.', which has to stay"),
        (lambda new, *_: replace(new, reference=next(k for k in new.poses if k != new.reference)),
         "got the reference 'blob_.', which was 'blob_.'"),
        (lambda new, *_: replace(new, unregistered=("x",)), "'x' unregistered, which was none"),
        (lambda new, *_: replace(new, components=({"x": np.eye(4)},)), "got 1 components of 0"),
        (lambda new, *_: replace(new, covariances={new.reference: np.full((6, 6), np.nan)}),
         r"Result.covariances\['blob_.'\]: expected finite numbers"),
        (lambda new, *_: replace(new, covariances=[]), "Result.covariances: expected Mapping, got"),
        (lambda new, *_: replace(new, links=(3,)), r"Result.links\[0\]: expected Link, got int 3"),
        (lambda new, *_: replace(new, model=new), "Result.model: expected Model, got a Result"),
    ],
    "strategy": [
        (posed(NAN), "expected finite numbers"),
        (lambda new, *_: replace(new, unregistered=("x",)), "got a Result with unknown 'x'"),
        (lambda new, *_: replace(new, unregistered=("blob_0",)), "more than once 'blob_0'"),
        (lambda new, *_: replace(new, poses={new.reference: np.eye(4)}), "Result without 'blob_"),
        (lambda new, *_: replace(new, poses={}), "expected a pose of the reference"),
        (lambda new, *_: replace(new, pairs=tuple(replace(p, source="y") for p in new.pairs)),
         "got a pair of unknown 'y'"),
        (lambda new, *_: replace(new, pairs=tuple(replace(p, T_target_source=None)
                                                  for p in new.pairs)),
         "got a pair of 'blob_.' that is reliable without a pose"),
        (lambda new, *_: replace(new, pairs=(3,)), "whose pairs contain int 3"),
        (lambda new, *_: replace(new, poses={k: se3.from_parts(np.eye(3), np.ones(3)) @ v
                                             for k, v in new.poses.items()}),
         "a pose of the reference 'blob_.' that is not the identity"),
    ],
    "seed": [
        (lambda new, *_: Matches(new.indices + np.array([10**6, 0]), new.distances),
         r"Matches.indices with position 1000\d\d\d, where the source has \d+ keypoints"),
        (lambda new, *_: Matches(new.indices + np.array([0, 10**6]), new.distances),
         "where the target has"),
        (lambda new, *_: Matches(-1 - new.indices, new.distances), "positions, 0 or more, got -"),
        (lambda new, *_: Matches(new.indices * 0.5, new.distances), "array of whole numbers, got"),
        (lambda new, *_: Matches(new.indices.T, new.distances), r"expected shape \(M, 2\), got"),
        (lambda new, *_: Matches(new.indices, new.distances[1:]), r"Matches.distances: expected"),
        (lambda new, *_: Matches(new.indices, new.distances * np.nan), "finite numbers, got nan"),
    ],
    "propagate": [
        (lambda new, *_: replace(new, poses=new.poses * np.nan), r"Candidates.poses: .* got nan"),
        (lambda new, *_: replace(new, poses=new.poses @ SCALED), r"Candidates.poses\[0\]: .*rigid"),
        (lambda new, *_: replace(new, matches=()), "expected . arrays, one per pose, got 0"),
        (lambda new, *_: replace(new, matches=tuple(m + 10**6 for m in new.matches)),
         r"Candidates.matches\[0\] with position 1000\d\d\d, where the source has"),
        (lambda new, *_: replace(new, scores=new.scores[1:]), "Candidates.scores: expected shape"),
    ],
    "refine": [
        (lambda new, *_: replace(new, T_target_source=NAN), "Registration.T_target_source: .* nan"),
        (lambda new, *_: replace(new, T_target_source=MIRROR), "got a reflection"),
        (lambda new, *_: replace(new, overlap=1.5), r"expected .* \[0, 1\], got float 1.5"),
        (lambda new, *_: replace(new, objective=np.nan), "Registration.objective: .* float nan"),
        (lambda new, *_: replace(new, trimmed_mse=-1.0), "Registration.trimmed_mse: .* float -1.0"),
        (lambda new, *_: replace(new, source="x"), "a registration of 'x' to 'blob_.', asked for"),
        (lambda new, *_: replace(new, pairs=new.pairs + np.array([0, 10**6])),
         "where the target has"),
        (lambda new, *_: replace(new, pairs=new.pairs[:0], distances=new.distances[:0]),
         "got a registration without a pair"),
    ],
    "judge": [
        (lambda new, *_: replace(new, reliable=1), "Verdict.reliable: .* True or False, got int 1"),
        (lambda new, *_: replace(new, score=np.nan), "Verdict.score: expected a number, got"),
        (lambda new, *_: replace(new, confidence=2.0), r"a number in \[0, 1\], got float 2.0"),
        (lambda new, *_: replace(new, reason=None), "Verdict.reason: expected str, got None"),
    ],
    "describe": [
        (lambda new, scan, *_: new if scan.name == "blob_0" else
         replace(new, descriptors=new.descriptors[:, 1:]),
         r"got descriptors of shape \(K, 9\) for 'blob_0' and \(K, 8\) for 'blob_1'"),
        (lambda new, scan, *_: new if scan.name == "blob_0" else
         replace(new, normals=new.normals[:, 1:]),
         r"got normals of shape \(K, 4, 3\) for 'blob_0' and \(K, 3, 3\) for 'blob_1'"),
        (lambda new, *_: replace(new, normals=2 * new.normals), "vectors, got one of length 2"),
        (lambda new, *_: replace(new, descriptors=new.descriptors[1:]), "Features.descriptors: "),
        (lambda new, *_: replace(new, normals=new.normals[:, 0]), r"expected shape \(\d+, L, 3\)"),
        (lambda new, *_: replace(new, descriptors=np.full_like(new.descriptors, np.inf)),
         "finite numbers, got"),
        (lambda new, *_: Features(*(np.concatenate([a, a]) for a in
                                    (new.keypoints, new.normals, new.descriptors)), True),
         r"got \d+ described keypoints of \d+"),
    ],
    "downsample": [
        (lambda new, *_: ([new[0][0], Sample(new[0][1].points[:0], new[0][1].keypoints),
                           new[0][2]], new[1]), "got no point of 'blob_1'"),
        (lambda new, *_: (new[0][1:], new[1]), "got 2 samples of 3 scans"),
        (lambda new, *_: (new[0], 0.0), "got float 0.0 for the spacing, which is positive"),
        (lambda new, *_: (new[0], None), "got None for the spacing"),
        (lambda new, *_: ([None] * 3, new[1]), "for the samples"),
        (lambda new, *_: ([Sample(s.points[:, :2], s.keypoints) for s in new[0]], new[1]),
         r"Sample.points: expected shape \(N, 3\), got \(\d+, 2\)"),
    ],
    "augment": [
        (lambda new, *_: replace(new, name="x"), r"got a model 'x' of 'blob_.', .* when 'blob_.'"),
        (lambda new, *_: replace(new, parts=()), "a model 'blob_.' of no parts"),
        (lambda new, *_: replace(new, normals=new.normals * 0), "unit vectors, got one of"),
        (lambda new, *_: replace(new, points=new.points[1:]), "Model.normals: expected shape"),
    ],
}  # fmt: skip
