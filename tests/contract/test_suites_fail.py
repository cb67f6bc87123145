"""What the suites are for: each of these stages breaks its contract, and is caught."""

import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from mvreg.datasets.base import ScanSource
from mvreg.geometry import se3
from mvreg.stages.adjust.none import NoAdjust
from mvreg.stages.augment.merge import ConcatAugment, MergeAugment
from mvreg.stages.describe.spectrum import SpectrumDescribe
from mvreg.stages.downsample.sampling import PaperDownsample
from mvreg.stages.downsample.voxels import voxel_centroids
from mvreg.stages.judge.residual import PointToPlaneJudge
from mvreg.stages.propagate.consensus import ConsensusPropagate
from mvreg.stages.refine.trimmed import ICP, TrimmedICP
from mvreg.stages.seed.nearest import NearestSeed
from mvreg.stages.strategy.grow import GrowStrategy
from mvreg.surface.normals import Orient
from mvreg.testing import SUITES, overlap
from mvreg.types import Candidates, Features, Matches, Sample, Scan, ScanSet, Verdict

FORM = "test_it_answers_in_the_right_form"
SAME = "test_the_same_input_gives_the_same_answer"
CALM = "test_it_takes_the_worst_calmly"
UNIT = "test_the_unit_of_length_does_not_matter"
MOVED = "test_poses_move_with_the_views"
BAD: list[Any] = []


def bad(kind: str, *tests: str, **waived: Any) -> Callable[[type], type]:
    """A stage of `kind` that these tests must catch."""

    def note(cls: type) -> type:
        BAD.extend(pytest.param(kind, cls, test, waived, id=f"{cls.__name__}-{test}")
                   for test in tests)  # fmt: skip
        return cls

    return note


@bad("seed", FORM)
@dataclass(frozen=True)
class WritesToItsInput(NearestSeed):
    """Not pure, and the arrays are read-only."""

    def __call__(self, source, target):
        found = super().__call__(source, target)
        source.features.descriptors[:1] *= 1.0000001
        return found


@bad("judge", FORM)
@dataclass(frozen=True)
class ForgetsTheOldest(PointToPlaneJudge):
    """Not pure, with the graph."""

    def __call__(self, registration, source, target, graph):
        found = super().__call__(registration, source, target, graph)
        object.__setattr__(graph, "edges", graph.edges[1:])
        return found


@bad("seed", FORM, "test_it_says_nothing")
@dataclass(frozen=True)
class Prints(NearestSeed):
    """Not silent."""

    def __call__(self, source, target):
        sys.stdout.write("seeding")
        return super().__call__(source, target)


@bad("seed", SAME)
@dataclass(frozen=True)
class DrawsItsOwn(NearestSeed):
    """Not the same twice."""

    def __call__(self, source, target):
        found = super().__call__(source, target)
        keep = np.random.default_rng().random(len(found)) < 0.9
        return Matches(found.indices[keep], found.distances[keep])


@bad("seed", "test_its_fields_are_all_there_is_to_it")
@dataclass(frozen=True)
class Remembers(NearestSeed):
    """Has a memory."""

    def __call__(self, source, target):
        object.__setattr__(self, "last", source)
        return super().__call__(source, target)


@bad("seed", "test_neither_frame_nor_unit_matters")
@dataclass(frozen=True)
class GoesByPlace(NearestSeed):
    """Near in space is not near in shape."""

    def __call__(self, source, target):
        if not len(target.features.keypoints):
            return super().__call__(source, target)
        distances, nearest = target.keypoint_tree.query(source.features.keypoints)
        best = np.argsort(distances, kind="stable")
        return Matches(np.stack([best, nearest[best]], axis=1), distances[best])


@bad("seed", "test_the_order_of_the_keypoints_does_not_matter", "test_a_view_finds_itself")
@dataclass(frozen=True)
class GoesByNumber(NearestSeed):
    """The first with the last."""

    def __call__(self, source, target):
        count = min(len(source.features.keypoints), len(target.features.keypoints))
        numbers = np.arange(count)
        return Matches(np.stack([numbers, numbers[::-1]], axis=1), np.zeros(count))


@bad("downsample", UNIT)
@dataclass(frozen=True)
class TenMillimetres(PaperDownsample):
    """A length of its own."""

    def __call__(self, scans, rng):
        return [Sample(s.points[::2], voxel_centroids(s.points, 10.0)) for s in scans], 10.0


@bad("downsample", "test_the_order_of_the_points_does_not_matter")
@dataclass(frozen=True)
class Strides(PaperDownsample):
    """Goes by the order, and does not say so."""

    min_points: int = 1


@bad("describe", "test_descriptors_are_invariant_and_normals_turn", UNIT)
@dataclass(frozen=True)
class Coordinates(SpectrumDescribe):
    """Where it is is not what it looks like."""

    def __call__(self, scan, keypoints, spacing):
        found = super().__call__(scan, keypoints, spacing)
        return replace(found, descriptors=np.tile(found.keypoints, 3))


@bad("describe", "test_descriptors_are_invariant_and_normals_turn")
@dataclass(frozen=True)
class TowardsTheOrigin(SpectrumDescribe):
    """The origin is no sensor."""

    orient: Orient = Orient.origin


@bad("describe", CALM)
@dataclass(frozen=True)
class DescribesNothingness(SpectrumDescribe):
    """NaN for what it cannot describe."""

    def __call__(self, scan, keypoints, spacing):
        found = super().__call__(scan, keypoints, spacing)
        if len(found.keypoints):
            return found
        nothing = np.full((len(keypoints), found.descriptors.shape[1]), np.nan)
        normals = np.zeros((len(keypoints), *found.normals.shape[1:]))
        return Features(keypoints, normals, nothing, found.oriented)


@bad("propagate", FORM, "test_views_that_overlap_are_found", CALM)
@dataclass(frozen=True)
class Guesses(ConsensusPropagate):
    """A mirror image, always."""

    def __call__(self, source, target, seeds, rng):
        mirror = np.diag([1.0, 1.0, -1.0, 1.0])[None]
        return Candidates(mirror, np.zeros(1), (np.zeros((1, 2), dtype=int),))


@bad("propagate", UNIT)
@dataclass(frozen=True)
class WithinMillimetres(ConsensusPropagate):
    """Its tolerance has a unit."""

    def __call__(self, source, target, seeds, rng):
        there = replace(source, scale=replace(source.scale, spacing=11.0))
        return super().__call__(there, target, seeds, rng)


@bad("refine", FORM)
@dataclass(frozen=True)
class LagsBehind(TrimmedICP):
    """Returns one pose, and the pairs of another."""

    def __call__(self, source, target, T_init):
        return replace(super().__call__(source, target, T_init), T_target_source=T_init)


@bad("refine", "test_scans_that_overlap_in_part_fit")
class FullOverlap(ICP):
    """Cannot do with part of it, and does not say so."""


@bad("refine", MOVED)
@dataclass(frozen=True)
class KeepsUpright(TrimmedICP):
    """Thinks that z is up."""

    def __call__(self, source, target, T_init):
        found = super().__call__(source, target, T_init)
        pose = found.T_target_source.copy()
        pose[2, 3] = T_init[2, 3]
        return replace(found, T_target_source=pose)


@bad("judge", "test_wrong_is_not_accepted", CALM)
@dataclass(frozen=True)
class Yes(PointToPlaneJudge):
    """Trusts everybody."""

    def __call__(self, registration, source, target, graph):
        return Verdict(True, float("nan"), 1.0, "why not")


@bad("judge", "test_right_is_accepted")
@dataclass(frozen=True)
class No(PointToPlaneJudge):
    """Trusts nobody."""

    max_residual: float = 0.001


@bad("judge", UNIT)
@dataclass(frozen=True)
class Millimetres(PointToPlaneJudge):
    """Two millimetres are good enough."""

    def __call__(self, registration, source, target, graph):
        score = float(np.sqrt(registration.trimmed_mse))
        return Verdict(score < 2, score, 2.0, "it is what it is")


@bad("augment", FORM)
@dataclass(frozen=True)
class PutsItAnywhere(ConcatAugment):
    """Forgets to move the view."""

    def __call__(self, model, source, registration):
        return super().__call__(model, source, replace(registration, T_target_source=np.eye(4)))


@bad("augment", FORM, "test_the_model_grows")
@dataclass(frozen=True)
class Forgets(MergeAugment):
    """The model stays as it was."""

    def __call__(self, model, source, registration):
        return model


@bad("augment", FORM)
@dataclass(frozen=True)
class ShortNormals(MergeAugment):
    """Means of unit vectors are shorter."""

    def __call__(self, model, source, registration):
        found = super().__call__(model, source, registration)
        return replace(found, normals=found.normals * 0.99)


@bad("strategy", FORM, "test_what_cannot_be_placed_is_reported")
@dataclass(frozen=True)
class PlacesEverything(GrowStrategy):
    """The identity for those it cannot place."""

    def __call__(self, views: Sequence, pipeline, rng):
        found = super().__call__(views, pipeline, rng)
        left = {name: np.diag([1.0, 1.0, 1.0, 2.0]) for name in found.unregistered}
        return replace(found, poses={**found.poses, **left}, unregistered=())


@bad("adjust", FORM)
@dataclass(frozen=True)
class LosesOne(NoAdjust):
    """One pose is gone."""

    def __call__(self, result, views, pipeline):
        return replace(result, poses={result.reference: np.eye(4)})


@bad("adjust", "test_poses_get_no_worse")
@dataclass(frozen=True)
class GivesUp(NoAdjust):
    """All poses are the reference's."""

    def __call__(self, result, views, pipeline):
        return replace(result, poses={name: np.eye(4) for name in result.poses})


@bad("dataset", FORM)
@dataclass(frozen=True)
class Twins(ScanSource):
    """Two scans of one name."""

    name: str = "twins"

    def load(self, rng):
        return ScanSet("twins", (Scan("a", np.eye(3)), Scan("a", np.eye(3))))


@bad("dataset", "test_scrambled_scans_keep_their_shape_and_their_truth")
@dataclass(frozen=True)
class TruthStays(ScanSource):
    """Moves the scans, and leaves the truth behind."""

    name: str = "moved"

    def load(self, rng):
        names = {"a": np.eye(4), "b": np.eye(4)}
        return ScanSet("moved", tuple(Scan(n, np.eye(3) + 1) for n in names), poses=names)

    def __call__(self, rng):
        loaded = self.load(rng)
        motion = se3.random(rng, 1.0) if self.scramble else np.eye(4)
        return replace(loaded, scans=tuple(scan.moved(motion) for scan in loaded.scans))


@pytest.mark.parametrize(("kind", "cls", "test", "waived"), BAD)
def test_it_is_caught(kind: str, cls: type, test: str, waived: Any) -> None:
    suite = type("Suite", (SUITES[kind],), {"stage": cls(), **waived})()
    with pytest.raises((AssertionError, ValueError)) as caught:
        getattr(suite, test)()
    said = str(caught.value)
    assert not isinstance(caught.value, AssertionError) or re.match("expected .*; got .", said), (
        said
    )


def test_every_suite_catches_something() -> None:
    assert {param.values[0] for param in BAD} == set(SUITES)


def test_candidates_that_are_off_are_measured_in_words():
    suite = SUITES["propagate"]()
    suite.stage = ConsensusPropagate()
    truth = overlap().T_target_source
    turned = truth @ se3.exp(np.array([0, 0, 0.5, 0, 0, 0]))
    far = Candidates(np.stack([np.eye(4), turned]), np.zeros(2), (np.empty((0, 2), dtype=int),) * 2)
    with pytest.raises(AssertionError, match="2 candidates, the nearest, number 2, off by 28"):
        suite.near(far, truth, overlap().source)
    with pytest.raises(AssertionError, match=r"true pose; got no candidate$"):
        suite.near(Candidates.none(), truth, overlap().source)
    with pytest.raises(
        AssertionError, match="expected a candidate for views that overlap; got none"
    ):
        suite.first(Candidates.none())
