"""The contract of `describe`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar
from unittest import SkipTest

import numpy as np

from mvreg import contracts
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree
from mvreg.testing.base import StageContract
from mvreg.testing.compare import assert_finite, assert_unit
from mvreg.testing.scans import RADIUS, blob_scans, degenerate_points
from mvreg.testing.views import AXES_SWAPPED, MOTION, UNITS, pipeline, scaled_scan
from mvreg.testing.words import above, close, equal, expect, is_a
from mvreg.types import Array, Features, Indices, Scan


class DescribeContract(StageContract):
    """Descriptors are invariant under rigid motion, and normals rotate with the scan."""

    stage: contracts.Describe
    kind = "describe"
    #: Largest difference of descriptors and normals between frames, units and orders of points.
    tolerance: ClassVar[float] = 1e-6
    #: This share of the normals may differ: seen edge-on, rounding decides where they point.
    strays: ClassVar[float] = 0.01
    #: Waived for a stage that describes nothing, on purpose.
    describes: ClassVar[bool] = True

    def scan(self) -> Scan:
        """The scan to describe."""
        return blob_scans(3).scans[0]

    def keypoints(self) -> tuple[Array, float]:
        """Keypoints of the scan, and their spacing."""
        pipe = pipeline()
        samples, spacing = pipe.downsample(blob_scans(3).scans, np.random.default_rng(0))
        return samples[0].keypoints, spacing

    def examples(self) -> dict[str, tuple[Any, ...]]:
        scan, (keypoints, spacing) = self.scan(), self.keypoints()
        blind = Scan(scan.name, scan.points)
        near = Scan(scan.name, scan.points, None, scan.points.mean(axis=0) + 5 * RADIUS)
        return {
            "sensor far away": (scan, keypoints, spacing),
            "sensor unknown": (blind, keypoints, spacing),
            "sensor near": (near, keypoints, spacing),
        }

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        scan, (keypoints, spacing) = self.scan(), self.keypoints()
        cases: dict[str, tuple[Any, ...]] = {
            "no keypoints": (scan, keypoints[:0], spacing),
            "one keypoint": (scan, keypoints[:1], spacing),
            "keypoints far from the scan": (scan, keypoints + 1e6, spacing),
            "everything is near": (scan, keypoints, 1e6 * spacing),
            "nothing is near": (scan, keypoints, 1e-6 * spacing),
            "nothing but itself is near": (scan, scan.points[:20], 1e-6 * spacing),
        }
        for name, points in degenerate_points().items():
            for towards in (None, scan.view_direction):
                sensor = "unknown" if towards is None else "known"
                cases[f"{name}, sensor {sensor}"] = (Scan("poor", points, towards), points, spacing)
        return cases

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        is_a("the answer", answer, Features)
        is_a("Features.oriented", answer.oriented, bool)
        count, size = len(answer.keypoints), self.stage(*self.examples()["sensor far away"])
        equal("Features.keypoints of shape", answer.keypoints.shape, (count, 3))
        equal(
            "Features.normals of shape (K, L, 3), L the same for all scans",
            answer.normals.shape,
            (count, size.normals.shape[1], 3),
        )
        equal(
            "Features.descriptors of shape (K, D), D the same for all scans",
            answer.descriptors.shape,
            (count, size.descriptors.shape[1]),
        )
        for array in (answer.keypoints, answer.normals, answer.descriptors):
            equal("arrays of dtype", array.dtype, np.dtype(np.float64))
        assert_unit(answer.normals)
        assert_finite(descriptors=answer.descriptors)
        equal("a declared spread that is the same for all scans", answer.spread, size.spread)
        rows = self.rows(answer.keypoints, arguments[1])
        in_order = (np.diff(rows) > 0).all() or len(np.unique(arguments[1], axis=0)) < len(
            arguments[1]
        )
        expect(
            in_order,
            "the keypoints that are described in the order in which they were given",
            "another order",
        )

    def rows(self, keypoints: Array, given: Array) -> Indices:
        """Which of the given keypoints are still there."""
        if not len(keypoints):
            return np.empty(0, dtype=np.intp)
        distances, rows = build_tree(given).query(keypoints)
        expect(
            (distances == 0).all(),
            "keypoints to be left out, not moved",
            f"one moved by {distances.max():.3g}",
        )
        found: Indices = rows
        return found

    def same(self, old: Features, new: Features, turn: Array) -> None:
        """Check that `new` is `old` in a frame turned by the rotation `turn`."""
        equal("the same number of described keypoints", len(new.keypoints), len(old.keypoints))
        equal("the same Features.oriented", new.oriented, old.oriented)
        close("the same descriptors", new.descriptors, old.descriptors, atol=self.tolerance)
        spreads = new.descriptor_spread, old.descriptor_spread
        close("the same descriptor_spread", *spreads, atol=self.tolerance)
        cosine = (new.normals * (old.normals @ turn.T)).sum(axis=-1)
        if not old.oriented:
            cosine = np.abs(cosine)
        stray = np.count_nonzero(np.abs(cosine - 1) > self.tolerance)
        expect(
            stray <= self.strays * cosine.size,
            "normals to turn with the scan",
            f"{stray} of {cosine.size} that do not",
        )

    def test_most_keypoints_are_described(self) -> None:
        keypoints, _ = self.keypoints()
        if not self.describes:
            raise SkipTest("this stage describes nothing, on purpose")
        for arguments in self.examples().values():
            above(
                "more than half of the keypoints to be described",
                len(self.call(*arguments).keypoints),
                len(keypoints) / 2,
            )

    def test_descriptors_are_invariant_and_normals_turn(self) -> None:
        for scan, keypoints, spacing in self.examples().values():
            old = self.call(scan, keypoints, spacing)
            # Opposite shifts: the origin, which is no sensor, is now on this side, now on that.
            other = se3.from_parts(MOTION[:3, :3], -MOTION[:3, 3])
            for motion in (AXES_SWAPPED, MOTION, other):
                there = se3.apply(motion, keypoints)
                self.same(old, self.call(scan.moved(motion), there, spacing), motion[:3, :3])

    def test_the_unit_of_length_does_not_matter(self) -> None:
        for scan, keypoints, spacing in self.examples().values():
            old = self.call(scan, keypoints, spacing)
            for unit in UNITS:
                new = self.call(scaled_scan(scan, unit), keypoints * unit, spacing * unit)
                self.same(old, new, np.eye(3))

    def test_the_order_of_the_keypoints_does_not_matter(self) -> None:
        for scan, keypoints, spacing in self.examples().values():
            old = self.call(scan, keypoints, spacing)
            order = np.random.default_rng(1).permutation(len(keypoints))
            new = self.call(scan, keypoints[order], spacing)
            back = np.argsort(self.rows(new.keypoints, keypoints))
            again = replace(
                new,
                keypoints=new.keypoints[back],
                normals=new.normals[back],
                descriptors=new.descriptors[back],
            )
            self.same(old, again, np.eye(3))

    def test_points_of_different_shape_look_different(self) -> None:
        if not self.describes:
            raise SkipTest("this stage describes nothing, on purpose")
        found = self.call(*self.examples()["sensor far away"]).descriptors
        expect(
            (found.std(axis=0) > 0).any(), "descriptors that tell points apart", "the same for all"
        )
