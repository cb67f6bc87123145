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
from mvreg.testing.words import above, close, equal, expect, is_a, same_array
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
        is_a("the answer", answer, ScanSet)
        expect(answer.name.strip(), "a data set with a name", repr(answer.name))
        expect(
            answer.unit.strip(),
            "a unit of length, or 'file' for that of the files",
            repr(answer.unit),
        )
        is_a("ScanSet.scans", answer.scans, tuple)
        expect(
            len(answer.scans) >= self.fewest, f"{self.fewest} scans or more", f"{len(answer.scans)}"
        )
        names = [scan.name for scan in answer.scans]
        expect(len(set(names)) == len(names), "a name of its own for every scan", names)
        for scan in answer.scans:
            self.verify_scan(scan)
        if answer.poses is not None:
            expect(
                set(answer.poses) <= set(names),
                "ground truth for scans that are there",
                sorted(set(answer.poses) - set(names)),
            )
            expect(
                answer.poses, "None for ScanSet.poses where no truth is known", "an empty mapping"
            )
            for pose in answer.poses.values():
                assert_rigid(pose)

    def verify_scan(self, scan: Scan) -> None:
        """A name, and points that are all there."""
        is_a("every scan", scan, Scan)
        expect(scan.name.strip(), "a scan with a name", repr(scan.name))
        equal("Scan.points of dtype", scan.points.dtype, np.dtype(np.float64))
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
        equal(
            "order=shuffle to give the same scans",
            sorted(scan.name for scan in shuffled.scans),
            sorted(old),
        )
        for scan in shuffled.scans:
            same_array(
                f"order=shuffle to leave {scan.name!r} as it is", scan.points, old[scan.name].points
            )

    def test_scrambled_scans_keep_their_shape_and_their_truth(self) -> None:
        if (source := self.source()) is None:
            return
        before = self.call(stage=replace(source, scramble=False))
        after = self.call(stage=replace(source, scramble=True))
        self.verify((), after)
        for old, new in zip(before.scans, after.scans, strict=True):
            motion = se3.fit(old.points, new.points)
            size = np.abs(old.points).max() + np.abs(new.points).max()
            close(
                "scramble=true to move scans as rigid bodies",
                se3.apply(motion, old.points),
                new.points,
                atol=1e-9 * size,
            )
            above(
                "scramble=true to turn every scan: radians",
                se3.rotation_angle(motion, np.eye(4)),
                1e-3,
            )
            if before.poses and old.name in before.poses:
                close(
                    "the ground truth to follow the scans that scramble=true moved",
                    after.poses[new.name] @ motion,
                    before.poses[old.name],
                    atol=1e-9 * size,
                )
