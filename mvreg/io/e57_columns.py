"""Points and attributes from the columns of an E57 scan, which come in pieces."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from mvreg.io.cloud import PointCloud
from mvreg.io.e57_header import GRID, NAMES, SPHERICAL, ScanHeader
from mvreg.types import Array
from mvreg.types.attributes import COLOURS, Values


@dataclass(eq=False)
class SeenColumns:
    """What the columns of a scan are, as far as all its points tell."""

    header: ScanHeader
    whole: dict[str, bool] = field(default_factory=dict)
    low: dict[str, float] = field(default_factory=dict)
    top: dict[str, float] = field(default_factory=dict)

    def cloud_of(self, columns: dict[str, Values]) -> PointCloud:
        """The valid points, and their attributes as the file has them."""
        header, left = self.header, dict(columns)
        state = left.pop(header.state, None)
        xyz = np.stack([left.pop(axis) for axis in header.axes], axis=1)
        if state is not None and state.any():
            valid = state == 0
            xyz = xyz[valid]
            left = {field: values[valid] for field, values in left.items()}
        return PointCloud(
            _cartesian(xyz) if header.axes == SPHERICAL else xyz,
            attributes={NAMES.get(field, field): values for field, values in left.items()},
        )

    def add(self, cloud: PointCloud) -> None:
        """Take notice of the colours of some points."""
        for name in {*COLOURS} & cloud.attributes.keys():
            values = cloud.attributes[name]
            whole = bool(np.all(values == np.round(values)))
            self.whole[name] = self.whole.get(name, True) and whole
            self.low[name] = float(values.min(initial=self.low.get(name, 0.0)))
            self.top[name] = float(values.max(initial=self.top.get(name, 0.0)))

    def finished(self, cloud: PointCloud) -> PointCloud:
        """The same with attributes in their types, once all points have been seen."""
        found: dict[str, Values] = {}
        for name, values in cloud.attributes.items():
            found[name] = (
                self._colour(values, name) if name in COLOURS
                else values.astype(np.int64) if name in GRID else values
            )  # fmt: skip
        return replace(cloud, attributes=found)

    def _colour(self, values: Values, name: str) -> Values:
        """As integers of 8 bits where the file's are, else of 16: the file says how far they go."""
        low, high = self.header.colour_limits[name]
        top = self.top.get(name, 0.0)
        whole = self.whole.get(name, True) and self.low.get(name, 0.0) >= 0 and top <= 65535
        if whole and high > 1:
            return values.astype(np.uint8 if max(top, high) <= 255 else np.uint16)
        width = high - low if np.isfinite(high - low) and high > low else 1.0
        return (np.clip((values - low) / width, 0, 1) * 65535).round().astype(np.uint16)


def _cartesian(spherical: Array) -> Array:
    """Of range, azimuth and elevation (N, 3), with angles in radians."""
    distance, azimuth, elevation = spherical.T
    level = distance * np.cos(elevation)
    return np.stack(
        [level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)], axis=1
    )
