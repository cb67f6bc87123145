"""The contract of `propagate`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from mvreg import contracts
from mvreg.geometry import se3
from mvreg.testing.base import StageContract
from mvreg.testing.compare import (
    apart,
    assert_finite,
    assert_indices,
    assert_rigid,
    case,
)
from mvreg.testing.views import (
    AXES_SWAPPED,
    MOTION,
    UNITS,
    degenerate_pairs,
    moved_view,
    overlap,
    pipeline,
    rescaled_descriptors,
    scaled_pose,
    scaled_view,
    shuffled_view,
)
from mvreg.testing.words import below, equal, expect, is_a, same_array
from mvreg.types import Array, Candidates, Matches, View


class PropagateContract(StageContract):
    """The true pose is among the candidates, whatever frames the views are in.

    Seeds are `seed=nearest`'s. Few of them are right, as in a run: of the 56 between the two views
    that overlap two are within 1.5 spacings. A stage that only has them vote finds nothing; what is
    right has to be spread over other keypoints, or tried on all.
    """

    stage: contracts.Propagate
    kind = "propagate"
    draws = True
    #: How far the best of the candidates is from the truth, at most: degrees, and spacings.
    max_angle: ClassVar[float] = 15.0
    max_shift: ClassVar[float] = 1.5
    #: How far apart the first candidates in two frames may be, in spacings.
    tolerance: ClassVar[float] = 0.01

    def seeds(self, source: View, target: View) -> Matches:
        """The seeds to spread."""
        return pipeline().seed(source, target)

    def examples(self) -> dict[str, tuple[Any, ...]]:
        pair = overlap()
        return {"overlap": (pair.source, pair.target, self.seeds(pair.source, pair.target))}

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        cases = {
            name: (source, target, self.seeds(source, target))
            for name, (source, target) in degenerate_pairs().items()
        }
        good = overlap()
        none = Matches(np.empty((0, 2), dtype=np.intp), np.empty(0))
        return {**cases, "no seeds": (good.source, good.target, none)}

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        source, target, _ = arguments
        is_a("the answer", answer, Candidates)
        count = len(answer)
        equal("Candidates.poses of shape", answer.poses.shape, (count, 4, 4))
        equal("Candidates.scores of shape", answer.scores.shape, (count,))
        equal("an array of matches per pose", len(answer.matches), count)
        assert_finite(scores=answer.scores)
        expect(
            (np.diff(answer.scores) >= 0).all(),
            "candidates by ascending score, the best first",
            answer.scores.tolist(),
        )
        for pose, matches in zip(answer.poses, answer.matches, strict=True):
            assert_rigid(pose)
            sizes = (len(view.features.keypoints) for view in (source, target))
            assert_indices(matches, *sizes)

    def errors(self, answer: Candidates, truth: Array, view: View) -> tuple[Array, Array]:
        """How far candidates are from the truth: degrees (C,), and spacings (C,) at the middle."""
        angles = np.rad2deg(se3.rotation_angle(answer.poses, truth))
        centre = view.points.mean(axis=0)
        moved = np.array([se3.apply(pose, centre) for pose in answer.poses]).reshape(-1, 3)
        shifts = np.linalg.norm(moved - se3.apply(truth, centre), axis=1)
        return angles, shifts / view.scale.spacing

    def near(self, answer: Candidates, truth: Array, view: View) -> None:
        """Raise AssertionError unless one of the candidates is near the truth."""
        angles, shifts = self.errors(answer, truth, view)
        came = "no candidate"
        if len(answer):
            best = int(np.argmin(np.maximum(angles / self.max_angle, shifts / self.max_shift)))
            came = (
                f"{len(answer)} candidates, the nearest, number {best + 1}, off by "
                f"{angles[best]:.3g} degrees and {shifts[best]:.3g} spacings"
            )
        expect(
            ((angles < self.max_angle) & (shifts < self.max_shift)).any(),
            f"a candidate within {self.max_angle:g} degrees and {self.max_shift:g} spacings of the "
            "true pose",
            came,
        )

    def first(self, answer: Candidates) -> Array:
        """The best candidate's pose (4, 4)."""
        expect(len(answer), "a candidate for views that overlap", "none")
        pose: Array = answer.poses[0]
        return pose

    def test_views_that_overlap_are_found(self) -> None:
        pair = overlap()
        answer = self.call(pair.source, pair.target, self.seeds(pair.source, pair.target))
        self.near(answer, pair.T_target_source, pair.source)

    def test_a_view_finds_itself(self) -> None:
        view = overlap().source
        other = moved_view(view, MOTION)
        self.near(self.call(view, other, self.seeds(view, other)), MOTION, view)

    def test_what_has_no_keypoints_has_no_candidates(self) -> None:
        for name, arguments in self.degenerate().items():
            if any(word in name for word in ("no seeds", "no keypoints", "one point")):
                with case(name):
                    equal(
                        "no candidate where there is nothing to go by",
                        len(self.call(*arguments)),
                        0,
                    )

    def test_poses_move_with_the_views(self) -> None:
        pair = overlap()
        seeds = self.seeds(pair.source, pair.target)
        old = self.first(self.call(pair.source, pair.target, seeds))
        for first, second in [(AXES_SWAPPED, np.eye(4)), (np.eye(4), AXES_SWAPPED),
                              (MOTION, se3.invert(MOTION))]:  # fmt: skip
            source, target = moved_view(pair.source, first), moved_view(pair.target, second)
            new = self.first(self.call(source, target, seeds))
            expected = second @ old @ se3.invert(first)
            limit = self.tolerance * source.scale.spacing
            below(
                "the first candidate to move with the views: keypoints apart",
                apart(new, expected, source.features.keypoints),
                limit,
            )

    def test_the_unit_of_length_does_not_matter(self) -> None:
        pair = overlap()
        seeds = self.seeds(pair.source, pair.target)
        old = self.call(pair.source, pair.target, seeds)
        for unit in UNITS:
            new = self.call(scaled_view(pair.source, unit), scaled_view(pair.target, unit), seeds)
            equal("as many candidates in another unit of length", len(new), len(old))
            for pose, expected in zip(new.poses, old.poses, strict=True):
                limit = 1e-6 * pair.source.scale.spacing
                below(
                    "the same candidates in another unit of length: points apart",
                    apart(scaled_pose(pose, 1 / unit), expected, pair.source.points),
                    limit,
                )

    def test_the_unit_of_the_descriptors_does_not_matter(self) -> None:
        """Tolerances are relative to the spread, be it declared or estimated."""
        pair = overlap()
        seeds = self.seeds(pair.source, pair.target)
        for declared in (pair.source.features.spread, None):
            views = [
                replace(view, features=replace(view.features, spread=declared))
                for view in (pair.source, pair.target)
            ]
            old = self.call(*views, seeds)
            self.near(old, pair.T_target_source, pair.source)
            for unit in UNITS:
                new = self.call(*(rescaled_descriptors(view, unit) for view in views), seeds)
                same_array(
                    "the same candidates in another unit of the descriptors", new.poses, old.poses
                )

    def test_the_order_of_the_keypoints_hardly_matters(self) -> None:
        """What is drawn at random differs; what is found must not."""
        pair = overlap()
        source, target = shuffled_view(pair.source, 1)[0], shuffled_view(pair.target, 2)[0]
        answer = self.call(source, target, self.seeds(source, target))
        self.near(answer, pair.T_target_source, source)
