"""What the tests of the strategies share: stages that know the truth, and say so or not."""

from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.geometry import se3
from mvreg.stages import TrimmedICP
from mvreg.testing import blob_scans, blob_views, pipeline
from mvreg.types import Candidates, Matches, Verdict, View


def blobs(count):
    """Views around the blob, 40 degrees apart: nine are all around."""
    return list(blob_views(count))


def truth(count):
    poses = blob_scans(count).poses
    return {name: se3.invert(poses["blob_0"]) @ pose for name, pose in poses.items()}


@dataclass(frozen=True)
class NoSeed:
    def __call__(self, source: View, target: View):
        return Matches.none()


@dataclass(frozen=True)
class TrueBut:
    """Candidates are the truth, but for pairs (source, target) in `instead`: a pose, or None."""

    count: int
    instead: dict = field(default_factory=dict)

    def __call__(self, source, target, seeds, rng):
        poses = truth(self.count)
        pose = se3.invert(poses[target.name]) @ poses[source.name]
        pose = self.instead.get((source.name, target.name), pose)
        return Candidates.none() if pose is None else Candidates(pose[None], np.zeros(1), ((),))


@dataclass(frozen=True)
class Trusting:
    def __call__(self, registration, source, target, graph):
        return Verdict(True, 0.0, 1.0, "trusts")


@dataclass(frozen=True)
class Keep:
    """Leaves a pose as it is."""

    def __call__(self, source, target, T_init):
        return TrimmedICP(max_iterations=0)(source, target, T_init)


def knowing(count, instead=None, judge=None):
    """A pipeline whose every pair is right, but for those in `instead`."""
    return replace(
        pipeline(),
        seed=NoSeed(),
        propagate=TrueBut(count, instead or {}),
        refine=Keep(),
        judge=judge or Trusting(),
    )


def off(result, count):
    """The largest angle, in degrees, by which a placed view is off."""
    right = truth(count)
    return max(
        float(np.rad2deg(se3.rotation_angle(pose, right[name])))
        for name, pose in result.poses.items()
    )


def turned(count, source, target, degrees=150.0):
    """The true pose of a pair, the source turned about its own middle."""
    poses = truth(count)
    pose = se3.invert(poses[target]) @ poses[source]
    view = next(view for view in blobs(count) if view.name == source)
    centre, half = view.points.mean(axis=0), np.deg2rad(degrees) / 2
    turn = se3.rotation_from_quaternion(np.array([np.sin(half), 0, 0, np.cos(half)]))
    return pose @ se3.from_parts(turn, centre - turn @ centre)
