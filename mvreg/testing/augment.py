"""The contract of `augment`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from mvreg import contracts
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree, mean_spacing
from mvreg.testing.base import StageContract
from mvreg.testing.compare import assert_finite, assert_unit, case, sorted_rows
from mvreg.testing.views import (
    AXES_SWAPPED,
    MOTION,
    UNITS,
    blob_views,
    degenerate_pairs,
    moved_view,
    overlap,
    registration,
    scaled_registration,
    scaled_view,
    shuffled_view,
)
from mvreg.testing.words import above, below, close, equal, expect, is_a
from mvreg.types import Array, Model, Registration, View


def farthest(points: Array, cloud: Array) -> float:
    """Distance of the point farthest from a cloud (length); 0 for no points."""
    if not len(points):
        return 0.0
    expect(len(cloud), "a model with points", "none")
    return float(build_tree(cloud).query(points)[0].max())


class AugmentContract(StageContract):
    """The model keeps its points and frame, and gains those that the view adds."""

    stage: contracts.Augment
    kind = "augment"
    #: Set it to False for stages that go by the points' order.
    ignores_point_order: ClassVar[bool] = True

    def begin(self) -> tuple[Model, View, Registration]:
        """A model, a view that overlaps it, and how the two fit."""
        pair = overlap()
        model = Model.of(pair.target)
        return model, pair.source, registration(pair.source, model, pair.T_target_source)

    def examples(self) -> dict[str, tuple[Any, ...]]:
        model, source, found = self.begin()
        fields = (model.name, model.points, model.normals, replace(model.features, oriented=False))
        blind = Model(*fields, model.resolution, model.scale, parts=model.parts)
        return {"overlap": (model, source, found), "signs unknown": (blind, source, found)}

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        cases = {}
        for name, (source, target) in degenerate_pairs().items():
            cases[name] = (Model.of(target), source, registration(source, target, np.eye(4)))
        return cases

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        model, source, found = arguments
        is_a("the answer", answer, Model)
        equal("the model to keep its name", answer.name, model.name)
        members = (*model.members, source.name)
        equal("the source behind the members that the model had", answer.members, members)
        equal("the model to keep its scale", answer.scale, model.scale)
        equal(
            "Features.oriented, if both are",
            answer.features.oriented,
            model.features.oriented and source.features.oriented,
        )
        equal(
            "Model.points and normals of shape",
            (answer.points.shape, answer.normals.shape),
            ((len(answer.points), 3),) * 2,
        )
        assert_finite(points=answer.points, resolution=answer.resolution)
        assert_unit(answer.normals)
        close(
            "Model.resolution to be the mean spacing of its points",
            answer.resolution,
            mean_spacing(answer.points),
        )
        own, new = model.features, answer.features
        count = len(new.keypoints)
        equal("Features.keypoints of shape", new.keypoints.shape, (count, 3))
        equal("Features.normals of shape", new.normals.shape, (count, *own.normals.shape[1:]))
        equal(
            "Features.descriptors of shape",
            new.descriptors.shape,
            (count, *own.descriptors.shape[1:]),
        )
        assert_unit(new.normals)
        assert_finite(keypoints=new.keypoints, descriptors=new.descriptors)
        self.verify_surface(model, source, found, answer)

    def verify_surface(
        self, model: Model, source: View, found: Registration, answer: Model
    ) -> None:
        """Nothing is lost, nothing is invented, to within the largest distance trimmed."""
        pose, size = found.T_target_source, np.abs(model.points).max()
        reach = found.trim_distance + 1e-9 * size
        for old, view, new in [
            (model.points, source.points, answer.points),
            (model.features.keypoints, source.features.keypoints, answer.features.keypoints),
        ]:
            both = np.concatenate([old, se3.apply(pose, view)])
            expect(
                len(new) <= len(both),
                f"at most the {len(both)} points of model and source together",
                f"{len(new)}",
            )
            expect(
                farthest(both, new) <= reach,
                f"all points of model and source to be kept, to within {reach:.3g}",
                f"a gap of {farthest(both, new):.3g}",
            )
            expect(
                farthest(new, both) <= reach,
                f"no point but those of model and source, to within {reach:.3g}",
                f"a point {farthest(new, both):.3g} away",
            )

    def test_the_model_grows(self) -> None:
        model, source, found = self.begin()
        answer = self.call(model, source, found)
        above("the model to grow: its points", len(answer.points), len(model.points))
        above(
            "the model to grow: its keypoints",
            len(answer.features.keypoints),
            len(model.features.keypoints),
        )

    def test_it_can_be_repeated(self) -> None:
        """A model of two is a model like any other; its members are in order."""
        model, source, found = self.begin()
        first = self.call(model, source, found)
        third = blob_views()[2]
        second = registration(third, first, found.T_target_source)
        answer = self.call(first, third, second)
        self.verify((first, third, second), answer)
        equal(
            "three members, in the order in which they came",
            answer.members,
            (model.members[0], source.name, third.name),
        )

    def test_a_view_merged_with_itself_stays_where_it_is(self) -> None:
        view = overlap().source
        model = Model.of(view)
        answer = self.call(model, view, registration(view, model, np.eye(4)))
        below(
            "a view merged with itself to stay: its points moved",
            farthest(answer.points, view.points),
            1e-9,
        )
        below(
            "a view merged with itself to stay: its keypoints moved",
            farthest(answer.features.keypoints, view.features.keypoints),
            1e-9,
        )
        nearest = build_tree(view.points).query(answer.points)[1]
        cosines = (answer.normals * view.normals[nearest]).sum(axis=1)
        close(
            "the normals of a view merged with itself to stay: cosines",
            cosines,
            np.ones(len(cosines)),
        )

    def test_the_model_moves_with_its_frame(self) -> None:
        model, source, found = self.begin()
        old = self.call(model, source, found)
        for first, second in [(AXES_SWAPPED, np.eye(4)), (MOTION, se3.invert(MOTION))]:
            pose = second @ found.T_target_source @ se3.invert(first)
            views = moved_view(model, second), moved_view(source, first)
            new = self.call(*views, replace(found, T_target_source=pose))
            self.same(new, moved_view(old, second))

    def test_the_unit_of_length_does_not_matter(self) -> None:
        model, source, found = self.begin()
        old = self.call(model, source, found)
        for unit in UNITS:
            views = scaled_view(model, unit), scaled_view(source, unit)
            self.same(self.call(*views, scaled_registration(found, unit)), scaled_view(old, unit))

    def test_the_order_of_the_points_does_not_matter(self) -> None:
        if not self.ignores_point_order:
            return
        model, source, found = self.begin()
        target, j, _ = shuffled_view(model, 1)
        other, i, _ = shuffled_view(source, 2)
        pairs = np.stack([np.argsort(i)[found.pairs[:, 0]], np.argsort(j)[found.pairs[:, 1]]], 1)
        new = self.call(target, other, replace(found, pairs=pairs))
        old = self.call(model, source, found)
        for mine, yours in [(new.points, old.points),
                            (new.features.keypoints, old.features.keypoints)]:  # fmt: skip
            close(
                "the same model when points come in another order",
                sorted_rows(mine),
                sorted_rows(yours),
                atol=1e-9,
            )

    def same(self, new: Model, old: Model) -> None:
        """Check that two models are one."""
        with case("the model elsewhere"):
            size = np.abs(old.points).max()
            close("the same points", new.points, old.points, atol=1e-9 * size)
            close("the same normals", new.normals, old.normals, atol=1e-9)
            mine, yours = new.features, old.features
            close("the same keypoints", mine.keypoints, yours.keypoints, atol=1e-9 * size)
            close("the same normals of the keypoints", mine.normals, yours.normals, atol=1e-9)
            close("the same descriptors", mine.descriptors, yours.descriptors, atol=1e-9)
            close("the same resolution", new.resolution, old.resolution, rtol=1e-6)
