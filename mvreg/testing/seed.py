"""The contract of `seed`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from mvreg import contracts
from mvreg.testing.base import StageContract
from mvreg.testing.compare import assert_finite, assert_indices
from mvreg.testing.views import (
    AXES_SWAPPED,
    MOTION,
    UNITS,
    degenerate_pairs,
    moved_view,
    overlap,
    rescaled_descriptors,
    scaled_view,
    shuffled_view,
)
from mvreg.testing.words import above, close, equal, expect, is_a, same_array
from mvreg.types import Matches


class SeedContract(StageContract):
    """Seeds depend on descriptors only, not on the frame, the unit of length or the order."""

    stage: contracts.Seed
    kind = "seed"
    #: Of the seeds between a view and itself moved, at least this share is right.
    self_matches: ClassVar[float] = 0.5

    def examples(self) -> dict[str, tuple[Any, ...]]:
        pair = overlap()
        return {
            "two views that overlap": (pair.source, pair.target),
            "a view and itself": (pair.source, replace(pair.source, name="other")),
        }

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        return {**degenerate_pairs()}

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        source, target = (len(view.features.keypoints) for view in arguments)
        is_a("the answer", answer, Matches)
        assert_indices(answer.indices, source, target)
        equal("Matches.distances of shape", answer.distances.shape, (len(answer),))
        equal("Matches.distances of dtype", answer.distances.dtype, np.dtype(np.float64))
        assert_finite(distances=answer.distances)
        expect(
            (answer.distances >= 0).all(),
            "distances of 0 or more",
            f"{answer.distances.min(initial=0):.3g}",
        )
        expect(
            (np.diff(answer.distances) >= 0).all(),
            "matches by ascending distance, the best first",
            "another order",
        )

    def pairs(self, answer: Matches) -> set[tuple[int, int]]:
        """The matches without their order."""
        return {(int(i), int(j)) for i, j in answer.indices}

    def test_views_that_overlap_give_seeds(self) -> None:
        pair = overlap()
        above(
            "seeds between views that overlap: their number",
            len(self.call(pair.source, pair.target)),
            0,
        )

    def test_without_keypoints_there_are_no_seeds(self) -> None:
        for name, arguments in self.degenerate().items():
            if "no keypoints" in name:
                equal("no seeds where there are no keypoints", len(self.call(*arguments)), 0)

    def test_neither_frame_nor_unit_matters(self) -> None:
        pair = overlap()
        old = self.call(pair.source, pair.target)
        others = [
            (moved_view(pair.source, AXES_SWAPPED), moved_view(pair.target, MOTION)),
            *((scaled_view(pair.source, u), scaled_view(pair.target, u)) for u in UNITS),
        ]
        for source, target in others:
            new = self.call(source, target)
            same_array(
                "the same seeds in another frame or unit of length", new.indices, old.indices
            )
            close(
                "the same distances in another frame or unit of length",
                new.distances,
                old.distances,
                rtol=1e-9,
            )

    def test_the_unit_of_the_descriptors_does_not_matter(self) -> None:
        pair = overlap()
        old = self.call(pair.source, pair.target)
        for unit in UNITS:
            views = (rescaled_descriptors(view, unit) for view in (pair.source, pair.target))
            same_array(
                "the same seeds in another unit of the descriptors",
                self.call(*views).indices,
                old.indices,
            )

    def test_the_order_of_the_keypoints_does_not_matter(self) -> None:
        pair = overlap()
        source, _, i = shuffled_view(pair.source, 1)
        target, _, j = shuffled_view(pair.target, 2)
        new = self.call(source, target)
        back = Matches(
            np.stack([i[new.indices[:, 0]], j[new.indices[:, 1]]], axis=1), new.distances
        )
        before = self.pairs(self.call(pair.source, pair.target))
        differ = len(self.pairs(back) ^ before)
        expect(not differ, "the same seeds in another order of the keypoints", f"{differ} others")

    def test_a_view_finds_itself(self) -> None:
        view = overlap().source
        found = self.call(view, moved_view(view, MOTION)).indices
        above("seeds between a view and itself: their number", len(found), 0)
        share = float((found[:, 0] == found[:, 1]).mean())
        expect(
            share >= self.self_matches,
            f"a share of {self.self_matches:g} of the seeds between a view and itself to be right",
            f"{share:.3g}",
        )
