"""The contract of `strategy`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from mvreg import contracts
from mvreg.events import Event
from mvreg.geometry import se3
from mvreg.testing.base import StageContract
from mvreg.testing.compare import digest
from mvreg.testing.results import assert_result, misplacement
from mvreg.testing.scans import blob_scans
from mvreg.testing.views import (
    UNITS,
    blob_views,
    degenerate_views,
    moved_view,
    pipeline,
    plain_view,
    scaled_pose,
    scaled_view,
)
from mvreg.testing.words import below, equal, expect
from mvreg.types import Array, Result, View


class StrategyContract(StageContract):
    """Scans that can be placed are placed correctly, the rest are reported, and it terminates."""

    stage: contracts.Strategy
    kind = "strategy"
    draws = True
    #: How far points may be from where they belong, in resolutions.
    sampled: ClassVar[float] = 2.0

    def truth(self) -> dict[str, Array]:
        """The exact poses ``T_world_scan`` of `blob_views`."""
        return dict(blob_scans(3).poses or {})

    def examples(self) -> dict[str, tuple[Any, ...]]:
        views = blob_views(3)
        bare = plain_view("bare", views[0].points, views[0].scale, keypoints=0)
        return {
            "three views": (list(views), pipeline()),
            "one has no keypoints": ([*views[:2], bare], pipeline()),
        }

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        cases: dict[str, tuple[Any, ...]] = {}
        for name, view in degenerate_views().items():
            cases[f"both: {name}"] = ([view, replace(view, name="other")], pipeline())
        good, poor = blob_views(3)[:1], degenerate_views()
        among = [replace(view, name=name) for name, view in poor.items() if name != "far away"]
        return {**cases, "all among good ones": ([*good, *among], pipeline())}

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        assert_result(answer, arguments[0])

    def essence(self, answer: Result) -> str:
        pairs = tuple(replace(pair, seconds={}) for pair in answer.pairs)
        return digest(replace(answer, pairs=pairs))

    def misplaced(self, answer: Result, views: Sequence[View]) -> float:
        """How far the worst placed point is off, in resolutions."""
        return misplacement(answer.poses, self.truth(), views, answer.reference)

    def test_views_that_overlap_are_placed(self) -> None:
        views = blob_views(3)
        answer = self.call(list(views), pipeline())
        equal("all of three views that overlap to be placed: unregistered", answer.unregistered, ())
        expect(
            len(answer.pairs) >= len(views) - 1,
            "every attempt to be recorded",
            f"{len(answer.pairs)} pairs for {len(views)} views",
        )
        below(
            "placed views to be where they belong: points misplaced",
            self.misplaced(answer, views),
            self.sampled,
            " resolutions",
        )

    def test_what_cannot_be_placed_is_reported(self) -> None:
        views, pipe = self.examples()["one has no keypoints"]
        answer = self.call(views, pipe)
        equal(
            "the view without keypoints to be reported: unregistered",
            answer.unregistered,
            ("bare",),
        )
        below(
            "placed views to be where they belong: points misplaced",
            self.misplaced(answer, views[:2]),
            self.sampled,
            " resolutions",
        )

    def test_poses_move_with_the_views(self) -> None:
        views, truth = blob_views(3), self.truth()
        motions = [se3.random(np.random.default_rng(i), 90.0) for i in range(len(views))]
        there = [moved_view(view, motion) for view, motion in zip(views, motions, strict=True)]
        answer = self.call(there, pipeline())
        equal("all of three views that overlap to be placed: unregistered", answer.unregistered, ())
        expected = {
            view.name: truth[view.name] @ se3.invert(motion)
            for view, motion in zip(views, motions, strict=True)
        }
        below(
            "poses to move with the views: points misplaced",
            misplacement(answer.poses, expected, there, answer.reference),
            self.sampled,
            " resolutions",
        )

    def test_the_unit_of_length_does_not_matter(self) -> None:
        views = blob_views(3)
        old = self.call(list(views), pipeline())
        for unit in UNITS:
            there = [scaled_view(view, unit) for view in views]
            new = self.call(there, pipeline())
            equal(
                "the same scans placed in another unit of length", list(new.poses), list(old.poses)
            )
            expected = {name: scaled_pose(pose, unit) for name, pose in old.poses.items()}
            below(
                "the same poses in another unit of length: points misplaced",
                misplacement(new.poses, expected, there, new.reference),
                1e-6,
                " resolutions",
            )

    def test_observers_do_not_change_the_answer(self) -> None:
        views = blob_views(3)
        told: list[Event] = []
        observed = self.call(list(views), pipeline().observed_by(told.append))
        expect(told, "observers to be told of the pairs, by the pipeline's methods", "no event")
        alone = self.essence(self.call(list(views), pipeline()))
        expect(self.essence(observed) == alone, "the same answer whether or not somebody observes")
