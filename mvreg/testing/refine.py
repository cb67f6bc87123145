"""The contract of `refine`."""

from __future__ import annotations

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
)
from mvreg.testing.views import (
    AXES_SWAPPED,
    MOTION,
    UNITS,
    degenerate_pairs,
    moved_view,
    overlap,
    scaled_pose,
    scaled_view,
    shuffled_view,
)
from mvreg.testing.words import below, close, equal, expect, is_a
from mvreg.types import Array, Registration, View


def nudge(view: View, degrees: float, resolutions: float) -> Array:
    """A small rigid motion (4, 4) about the centroid of a view."""
    centre = view.points.mean(axis=0)
    axis = np.array([0.6, -0.5, 0.62]) / np.linalg.norm([0.6, -0.5, 0.62])
    half = np.deg2rad(degrees) / 2
    turn = se3.rotation_from_quaternion(np.append(np.sin(half) * axis, np.cos(half)))
    shift = resolutions * view.resolution * np.array([0.48, 0.6, -0.64])
    return se3.from_parts(turn, centre - turn @ centre + shift)


class RefineContract(StageContract):
    """The pose improves, and the record is consistent with the pairs that it rests on."""

    stage: contracts.Refine
    kind = "refine"
    #: Set it to False for stages that need full overlap, as plain ICP does.
    partial_overlap: ClassVar[bool] = True
    #: Where it starts from: degrees and resolutions from the truth.
    start: ClassVar[tuple[float, float]] = (4.0, 1.0)
    #: How far points may be from where they belong in the end, in resolutions: for a view and
    #: itself, and for two scans, whose points differ.
    exact: ClassVar[float] = 1e-3
    sampled: ClassVar[float] = 1.0
    #: How far apart the poses found in two frames may be, in resolutions.
    tolerance: ClassVar[float] = 0.01

    def begin(self) -> tuple[View, View, Array]:
        """Two views, and a pose near the right one."""
        pair = overlap()
        return pair.source, pair.target, pair.T_target_source @ nudge(pair.source, *self.start)

    def examples(self) -> dict[str, tuple[Any, ...]]:
        return {"two views that overlap": self.begin()}

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        wrong = se3.random(np.random.default_rng(2), 30.0)
        cases: dict[str, tuple[Any, ...]] = {}
        for name, (source, target) in degenerate_pairs().items():
            cases[name] = (source, target, np.eye(4))
        good = overlap()
        return {**cases, "a wrong start": (good.source, good.target, wrong)}

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        source, target, _ = arguments
        is_a("the answer", answer, Registration)
        equal(
            "the names of source and target",
            (answer.source, answer.target),
            (source.name, target.name),
        )
        assert_rigid(answer.T_target_source)
        assert_indices(answer.pairs, len(source.points), len(target.points))
        expect(len(answer.pairs) >= 1, "a registration that rests on one pair at least", "none")
        expect(0 < answer.overlap <= 1, "an overlap in (0, 1]", answer.overlap)
        assert_finite(mse=answer.trimmed_mse, objective=answer.objective)
        is_a("Registration.iterations", answer.iterations, int)
        is_a("Registration.converged", answer.converged, bool)
        i, j = answer.pairs.T
        gaps = se3.apply(answer.T_target_source, source.points[i]) - target.points[j]
        size = 1e-9 * max(np.abs(target.points).max(), np.abs(gaps).max())
        lengths = np.linalg.norm(gaps, axis=1)
        close(
            "distances of the pairs under the pose that is returned",
            answer.distances,
            lengths,
            rtol=1e-6,
            atol=size,
        )
        squares = (answer.distances**2).mean()
        close(
            "trimmed_mse to be the mean of the squared distances",
            answer.trimmed_mse,
            squares,
            rtol=1e-6,
            atol=size**2,
        )
        close(
            "trim_distance to be the largest distance",
            answer.trim_distance,
            answer.distances.max(),
            rtol=1e-9,
        )
        if self.partial_overlap:
            expect(
                abs(answer.overlap * len(source.points) - len(i)) < 1,
                "overlap to be the share of the source's points that are in pairs",
                f"{answer.overlap:.3g} with {len(i)} pairs of {len(source.points)} points",
            )

    def test_a_view_finds_itself(self) -> None:
        view = overlap().source
        other = moved_view(view, MOTION)
        found = self.call(view, other, MOTION @ nudge(view, *self.start)).T_target_source
        below(
            "a view to find itself: points misplaced",
            apart(found, MOTION, view.points) / view.resolution,
            self.exact,
            " resolutions",
        )

    def test_scans_that_overlap_in_part_fit(self) -> None:
        pair, begin = overlap(), self.begin()
        before = apart(begin[2], pair.T_target_source, pair.source.points)
        found = self.call(*begin).T_target_source
        after = apart(found, pair.T_target_source, pair.source.points)
        if self.partial_overlap:
            below(
                "two scans that overlap to fit better than at the start: points misplaced",
                after,
                min(before, self.sampled * pair.source.resolution),
            )

    def test_it_stays_where_it_has_arrived(self) -> None:
        source, target, start = self.begin()
        found = self.call(source, target, start).T_target_source
        again = self.call(source, target, found).T_target_source
        below(
            "to stay where it has arrived: points moved",
            apart(found, again, source.points) / source.resolution,
            0.1,
            " resolutions",
        )

    def test_poses_move_with_the_views(self) -> None:
        source, target, start = self.begin()
        old = self.call(source, target, start).T_target_source
        for first, second in [(AXES_SWAPPED, np.eye(4)), (np.eye(4), AXES_SWAPPED),
                              (MOTION, se3.invert(MOTION))]:  # fmt: skip
            views = moved_view(source, first), moved_view(target, second)
            found = self.call(*views, second @ start @ se3.invert(first)).T_target_source
            back = se3.invert(second) @ found @ first
            below(
                "the same pose in other frames: points apart",
                apart(back, old, source.points) / source.resolution,
                self.tolerance,
                " resolutions",
            )

    def test_the_unit_of_length_does_not_matter(self) -> None:
        source, target, start = self.begin()
        old = self.call(source, target, start)
        for unit in UNITS:
            views = scaled_view(source, unit), scaled_view(target, unit)
            new = self.call(*views, scaled_pose(start, unit))
            pose = scaled_pose(new.T_target_source, 1 / unit)
            below(
                "the same pose in another unit of length: points apart",
                apart(pose, old.T_target_source, source.points) / source.resolution,
                1e-6,
                " resolutions",
            )
            close("the same overlap in another unit of length", new.overlap, old.overlap)
            close(
                "the same trimmed_mse, in the other unit squared",
                new.trimmed_mse,
                old.trimmed_mse * unit**2,
            )

    def test_the_order_of_the_points_does_not_matter(self) -> None:
        source, target, start = self.begin()
        old = self.call(source, target, start)
        shuffled = shuffled_view(source, 1)[0], shuffled_view(target, 2)[0]
        new = self.call(*shuffled, start)
        limit = self.tolerance * source.resolution
        below(
            "the same pose in another order of the points: points apart",
            apart(new.T_target_source, old.T_target_source, source.points),
            limit,
        )
