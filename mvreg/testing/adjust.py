"""The contract of `adjust`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any, ClassVar

import numpy as np

from mvreg import contracts
from mvreg.geometry import se3
from mvreg.testing.base import StageContract
from mvreg.testing.refine import nudge
from mvreg.testing.results import assert_result, misplacement
from mvreg.testing.scans import blob_scans
from mvreg.testing.views import (
    AXES_SWAPPED,
    MOTION,
    UNITS,
    blob_views,
    degenerate_views,
    moved_view,
    pipeline,
    scaled_pose,
    scaled_view,
)
from mvreg.testing.words import below, equal, expect, same_array
from mvreg.types import Array, Result, View


@cache
def nearly_right(degrees: float = 0.5, resolutions: float = 0.3) -> Result:
    """The poses of `blob_views`, all but the first slightly perturbed."""
    views, truth = blob_views(3), blob_scans(3).poses or {}
    first = truth[views[0].name]
    poses = {views[0].name: np.eye(4)}
    for index, view in enumerate(views[1:]):
        off = nudge(view, degrees * (-1) ** index, resolutions)
        poses[view.name] = se3.invert(first) @ truth[view.name] @ off
    return Result(views[0].name, poses, (), ())


class AdjustContract(StageContract):
    """Poses do not get worse, and no scan is lost or invented."""

    stage: contracts.Adjust
    kind = "adjust"
    #: How far points may be from where they belong, in resolutions, where they began less far.
    slack: ClassVar[float] = 0.2
    #: How far apart the poses found in two frames may be, in resolutions.
    tolerance: ClassVar[float] = 0.01

    def examples(self) -> dict[str, tuple[Any, ...]]:
        views, result = list(blob_views(3)), nearly_right()
        left = views[2].name
        poses = {name: pose for name, pose in result.poses.items() if name != left}
        partial = replace(result, poses=poses, unregistered=(left,))
        return {
            "all placed": (result, views, pipeline()),
            "one not placed": (partial, views, pipeline()),
        }

    def two_components(self) -> tuple[Result, list[View]]:
        """The scans of `nearly_right` twice, the second time as a component under other names."""
        result, views = nearly_right(), list(blob_views(3))
        again = [replace(view, name=f"again {view.name}") for view in views]
        second = {f"again {name}": pose for name, pose in result.poses.items()}
        return replace(result, components=(second,)), [*views, *again]

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        good = blob_views(3)[0]
        alone = Result(good.name, {good.name: np.eye(4)}, (), ())
        cases: dict[str, tuple[Any, ...]] = {"only the reference": (alone, [good], pipeline())}
        for name, view in degenerate_views().items():
            poses = {good.name: np.eye(4), "poor": np.eye(4), "other": np.eye(4)}
            views = [good, replace(view, name="poor"), replace(view, name="other")]
            cases[name] = (Result(good.name, poses, (), ()), views, pipeline())
        return cases

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        result, views, _ = arguments
        assert_result(answer, views)
        equal("the reference to stay", answer.reference, result.reference)
        equal("poses of the same scans", sorted(answer.poses), sorted(result.poses))
        expect(
            answer.pairs == result.pairs,
            "the same pairs as before the adjustment",
            f"{len(answer.pairs)} pairs",
        )

    def misplaced(self, result: Result, views: Sequence[View]) -> float:
        """How far the worst placed point is off, in resolutions."""
        return misplacement(result.poses, blob_scans(3).poses or {}, views, result.reference)

    def test_poses_get_no_worse(self) -> None:
        for result, views, _ in self.examples().values():
            after = self.misplaced(self.call(result, views, pipeline()), views)
            limit = max(self.misplaced(result, views), self.slack)
            expect(
                after <= limit,
                f"points to be misplaced by {limit:.3g} resolutions at most, as before",
                f"{after:.3g}",
            )

    def test_components_are_adjusted_as_the_reference_s_model_is(self) -> None:
        result, views = self.two_components()
        alone = self.call(nearly_right(), list(blob_views(3)), pipeline())
        both = self.call(result, views, pipeline())
        (second,) = both.components
        equal(
            "the component to keep its scans, in their order",
            list(second),
            list(result.components[0]),
        )
        same_array(
            "the identity for the first scan of a component", next(iter(second.values())), np.eye(4)
        )
        for name, pose in alone.poses.items():
            same_array(
                "the poses of the reference's model as they are without another component",
                both.poses[name],
                pose,
            )
            same_array(
                "a component to be adjusted as the same scans are in the reference's model",
                second[f"again {name}"],
                pose,
            )

    def test_poses_move_with_the_views(self) -> None:
        result, views, pipe = self.examples()["all placed"]
        motions = dict(zip(result.poses, (MOTION, AXES_SWAPPED, np.eye(4)), strict=True))
        poses = {name: self.elsewhere(result, name, motions) for name in result.poses}
        there = [moved_view(view, motions[view.name]) for view in views]
        new = self.call(replace(result, poses=poses), there, pipe)
        old = self.call(result, views, pipe)
        expected = {name: self.elsewhere(old, name, motions) for name in old.poses}
        below(
            "the same poses when the scans are in other frames: points misplaced",
            misplacement(new.poses, expected, there, new.reference),
            self.tolerance,
            " resolutions",
        )

    def elsewhere(self, result: Result, name: str, motions: dict[str, Array]) -> Array:
        """The pose that a scan has when all scans have moved."""
        first, own = motions[result.reference], motions[name]
        if name == result.reference:
            return np.eye(4)
        pose: Array = first @ result.poses[name] @ se3.invert(own)
        return pose

    def test_the_unit_of_length_does_not_matter(self) -> None:
        result, views, pipe = self.examples()["all placed"]
        old = self.call(result, views, pipe)
        for unit in UNITS:
            poses = {name: scaled_pose(pose, unit) for name, pose in result.poses.items()}
            there = [scaled_view(view, unit) for view in views]
            new = self.call(replace(result, poses=poses), there, pipe)
            expected = {name: scaled_pose(pose, unit) for name, pose in old.poses.items()}
            below(
                "the same poses in another unit of length: points misplaced",
                misplacement(new.poses, expected, there, new.reference),
                1e-6,
                " resolutions",
            )
