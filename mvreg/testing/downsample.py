"""The contract of `downsample`."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from mvreg import contracts
from mvreg.geometry import se3
from mvreg.geometry.nearest import build_tree
from mvreg.testing.base import StageContract
from mvreg.testing.compare import assert_finite, case, sorted_rows
from mvreg.testing.scans import blob_scans, degenerate_points
from mvreg.testing.views import AXES_SWAPPED, MOTION, UNITS, scaled_scan
from mvreg.testing.words import below, close, equal, expect, is_a
from mvreg.types import Array, Sample, Scan


class DownsampleContract(StageContract):
    """Samples lie on the scan, and their number does not depend on its pose."""

    stage: contracts.Downsample
    kind = "downsample"
    draws = True
    #: Set it to False for stages that go by the points' order, as strides do.
    ignores_point_order: ClassVar[bool] = True
    #: By this share the counts and the spacing may change when the scans move: grids have a phase.
    phase: ClassVar[float] = 0.15

    def scans(self) -> tuple[Scan, ...]:
        """The scans to thin out."""
        return blob_scans(3).scans

    def examples(self) -> dict[str, tuple[Any, ...]]:
        return {"three scans": (self.scans(),), "one scan": (self.scans()[:1],)}

    def degenerate(self) -> dict[str, tuple[Any, ...]]:
        poor = {name: Scan(name, points) for name, points in degenerate_points().items()}
        alone = {f"only {name}": ((scan, scan),) for name, scan in poor.items()}
        return {**alone, "all among good ones": ((*self.scans(), *poor.values()),)}

    def verify(self, arguments: tuple[Any, ...], answer: Any) -> None:
        samples, spacing = answer
        is_a("the spacing", spacing, float)
        expect(0 < spacing < np.inf, "a spacing that is positive and finite", spacing)
        equal("a sample per scan", len(samples), len(arguments[0]))
        for scan, sample in zip(arguments[0], samples, strict=True):
            with case(scan.name):
                is_a("every sample", sample, Sample)
                self.verify_points(sample.points, scan, spacing)
                self.verify_points(sample.keypoints, scan, spacing)

    def verify_points(self, points: Array, scan: Scan, spacing: float) -> None:
        """Some points, (N, 3) float64, no more than the scan has, none far from it."""
        equal("arrays of dtype", points.dtype, np.dtype(np.float64))
        equal("points of shape", points.shape, (len(points), 3))
        assert_finite(points=points)
        expect(
            1 <= len(points) <= len(scan.points),
            f"1 to {len(scan.points)} points",
            f"{len(points)}",
        )
        extent = np.ptp(scan.points, axis=0).max()
        distances, _ = build_tree(scan.points).query(points)
        expect(
            distances.max() <= spacing + 1e-9 * extent,
            f"samples within {spacing:.3g} of the scan's points",
            f"one {distances.max():.3g} away",
        )

    def test_it_thins_out(self) -> None:
        samples, _ = self.call(self.scans())
        for scan, sample in zip(self.scans(), samples, strict=True):
            below(
                "fewer keypoints than the scan has points: their number",
                len(sample.keypoints),
                len(scan.points),
            )
            expect(
                len(sample.points) <= len(scan.points),
                f"at most the {len(scan.points)} points of the scan",
                f"{len(sample.points)}",
            )

    def test_the_unit_of_length_does_not_matter(self) -> None:
        samples, spacing = self.call(self.scans())
        for unit in UNITS:
            scans = tuple(scaled_scan(scan, unit) for scan in self.scans())
            again, other = self.call(scans)
            close("a spacing in the unit of the scans", other, spacing * unit, rtol=1e-9)
            for old, new in zip(samples, again, strict=True):
                close("the same points in another unit", new.points, old.points * unit, rtol=1e-9)
                close(
                    "the same keypoints in another unit",
                    new.keypoints,
                    old.keypoints * unit,
                    rtol=1e-9,
                )

    def test_the_frame_hardly_matters(self) -> None:
        """Grids and strides are not equivariant; how much they leave must be, nearly."""
        samples, spacing = self.call(self.scans())
        for motion in (AXES_SWAPPED, MOTION):
            again, other = self.call(tuple(scan.moved(motion) for scan in self.scans()))
            below(
                "about the same spacing in another frame: relative difference",
                abs(other / spacing - 1),
                self.phase,
            )
            for old, new in zip(samples, again, strict=True):
                below(
                    "about as many points in another frame: relative difference",
                    abs(len(new.points) / len(old.points) - 1),
                    self.phase,
                )
                below(
                    "about as many keypoints in another frame: relative difference",
                    abs(len(new.keypoints) / len(old.keypoints) - 1),
                    self.phase,
                )
                tree = build_tree(se3.apply(motion, old.keypoints))
                below(
                    "keypoints in another frame to be near those in the first: distance",
                    tree.query(new.keypoints)[0].max(),
                    2 * spacing,
                )

    def test_the_order_of_the_points_does_not_matter(self) -> None:
        if not self.ignores_point_order:
            return
        rng = np.random.default_rng(1)
        shuffled = tuple(Scan(s.name, rng.permutation(s.points)) for s in self.scans())
        samples, spacing = self.call(self.scans())
        again, other = self.call(shuffled)
        close("the same spacing in another order of the points", other, spacing)
        for old, new in zip(samples, again, strict=True):
            close(
                "the same keypoints in another order of the points",
                sorted_rows(new.keypoints),
                sorted_rows(old.keypoints),
            )
            close(
                "the same points in another order of the points",
                sorted_rows(new.points),
                sorted_rows(old.points),
            )
