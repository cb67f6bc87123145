"""The contract of `dataset`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from mvreg import contracts
from mvreg.datasets.base import Order, ScanSource
from mvreg.geometry import se3
from mvreg.testing.base import StageContract
from mvreg.testing.compare import assert_finite, assert_rigid
from mvreg.types import Scan, ScanSet


class DatasetContract(StageContract):
    """Scans have unique names, and the ground truth stays valid when they are moved."""

    stage: contracts.Dataset
    kind = "dataset"
    draws = True
    #: Fewer scans are no data set.
    fewest: ClassVar[int] = 2

    def examples(self) -> dict[str, tuple[Any, ...]]:
        return {"as it is": ()}

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        assert isinstance(answer, ScanSet)
        assert answer.name.strip()
        assert answer.unit.strip()
        assert isinstance(answer.scans, tuple)
        assert len(answer.scans) >= self.fewest
        names = [scan.name for scan in answer.scans]
        assert len(set(names)) == len(names), "two scans share a name"
        for scan in answer.scans:
            self.verify_scan(scan)
        if answer.poses is not None:
            assert set(answer.poses) <= set(names), "a pose of a scan that is not there"
            assert answer.poses, "no truth at all is None"
            for pose in answer.poses.values():
                assert_rigid(pose)

    def verify_scan(self, scan: Scan) -> None:
        """A name, and points that are all there."""
        assert isinstance(scan, Scan)
        assert scan.name.strip()
        assert scan.points.dtype == np.float64
        assert_finite(points=scan.points)

    def source(self) -> ScanSource | None:
        """The data set, if it can shuffle and scramble."""
        return self.stage if isinstance(self.stage, ScanSource) else None

    def test_a_random_order_has_the_same_scans(self) -> None:
        if (source := self.source()) is None:
            return
        given = self.call(stage=replace(source, order=Order.given))
        shuffled = self.call(stage=replace(source, order=Order.shuffle))
        self.verify((), shuffled)
        old = {scan.name: scan for scan in given.scans}
        assert {scan.name for scan in shuffled.scans} == set(old)
        for scan in shuffled.scans:
            np.testing.assert_array_equal(scan.points, old[scan.name].points)

    def test_scrambled_scans_keep_their_shape_and_their_truth(self) -> None:
        if (source := self.source()) is None:
            return
        before = self.call(stage=replace(source, scramble=False))
        after = self.call(stage=replace(source, scramble=True))
        self.verify((), after)
        for old, new in zip(before.scans, after.scans, strict=True):
            motion = se3.fit(old.points, new.points)
            size = np.abs(old.points).max() + np.abs(new.points).max()
            np.testing.assert_allclose(se3.apply(motion, old.points), new.points, atol=1e-9 * size)
            assert se3.rotation_angle(motion, np.eye(4)) > 1e-3, "it was not moved"
            if before.poses and old.name in before.poses:
                np.testing.assert_allclose(
                    after.poses[new.name] @ motion, before.poses[old.name], atol=1e-9 * size
                )
