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
        assert isinstance(spacing, float)
        assert np.isfinite(spacing)
        assert spacing > 0
        assert len(samples) == len(arguments[0])
        for scan, sample in zip(arguments[0], samples, strict=True):
            with case(scan.name):
                assert isinstance(sample, Sample)
                self.verify_points(sample.points, scan, spacing)
                self.verify_points(sample.keypoints, scan, spacing)

    def verify_points(self, points: Array, scan: Scan, spacing: float) -> None:
        """Some points, (N, 3) float64, no more than the scan has, none far from it."""
        assert points.dtype == np.float64
        assert points.shape == (len(points), 3)
        assert_finite(points=points)
        assert 1 <= len(points) <= len(scan.points), "at least one point must be left"
        extent = np.ptp(scan.points, axis=0).max()
        distances, _ = build_tree(scan.points).query(points)
        assert distances.max() <= spacing + 1e-9 * extent, "a sample is off the surface"

    def test_it_thins_out(self) -> None:
        samples, _ = self.call(self.scans())
        for scan, sample in zip(self.scans(), samples, strict=True):
            assert len(sample.keypoints) < len(scan.points)
            assert len(sample.points) <= len(scan.points)

    def test_the_unit_of_length_does_not_matter(self) -> None:
        samples, spacing = self.call(self.scans())
        for unit in UNITS:
            scans = tuple(scaled_scan(scan, unit) for scan in self.scans())
            again, other = self.call(scans)
            np.testing.assert_allclose(other, spacing * unit, rtol=1e-9)
            for old, new in zip(samples, again, strict=True):
                np.testing.assert_allclose(new.points, old.points * unit, rtol=1e-9)
                np.testing.assert_allclose(new.keypoints, old.keypoints * unit, rtol=1e-9)

    def test_the_frame_hardly_matters(self) -> None:
        """Grids and strides are not equivariant; how much they leave must be, nearly."""
        samples, spacing = self.call(self.scans())
        for motion in (AXES_SWAPPED, MOTION):
            again, other = self.call(tuple(scan.moved(motion) for scan in self.scans()))
            assert abs(other / spacing - 1) < self.phase
            for old, new in zip(samples, again, strict=True):
                assert abs(len(new.points) / len(old.points) - 1) < self.phase
                assert abs(len(new.keypoints) / len(old.keypoints) - 1) < self.phase
                tree = build_tree(se3.apply(motion, old.keypoints))
                assert tree.query(new.keypoints)[0].max() < 2 * spacing

    def test_the_order_of_the_points_does_not_matter(self) -> None:
        if not self.ignores_point_order:
            return
        rng = np.random.default_rng(1)
        shuffled = tuple(Scan(s.name, rng.permutation(s.points)) for s in self.scans())
        samples, spacing = self.call(self.scans())
        again, other = self.call(shuffled)
        np.testing.assert_allclose(other, spacing)
        for old, new in zip(samples, again, strict=True):
            np.testing.assert_allclose(sorted_rows(new.keypoints), sorted_rows(old.keypoints))
            np.testing.assert_allclose(sorted_rows(new.points), sorted_rows(old.points))
