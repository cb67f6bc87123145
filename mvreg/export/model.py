"""The points of one component, scan by scan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np

from mvreg.errors import few
from mvreg.export.placements import Component, Placements
from mvreg.geometry import se3
from mvreg.io import PointCloud
from mvreg.io.cloud_stream import some_of
from mvreg.report.model import (
    INDEX,
    RESIDUAL,
    PlacedScan,
    kinds_of,
    model_kinds,
    pieces_of,
    placed,
    placed_scans,
)
from mvreg.types import Array, Scan, ScanSet, View


@dataclass(frozen=True, eq=False)
class Model:
    """The scans of one component, with their points.

    Parameters
    ----------
    scanset : ScanSet
        The scans of the run, loaded again or still there.
    component : Component
        Where they are.
    placements : Placements
        Of the whole run.
    views : sequence of View
        As they were registered, if they are still there: then points have their residuals.
    """

    scanset: ScanSet
    component: Component
    placements: Placements
    views: Sequence[View] = ()

    @property
    def poses(self) -> dict[str, Array]:
        """``T_model_scan`` (4, 4) of the scans as they were loaded, which may have moved them."""
        motions = self.scanset.motions
        return {
            name: pose @ se3.invert(motions[name]) if name in motions else pose
            for name, pose in self.component.poses.items()
        }

    @property
    def kinds(self) -> dict[str, np.dtype[Any]]:
        """The attributes of the model by name, and their types."""
        return model_kinds(self.scanset, self.poses, self.views)

    @cached_property
    def placed(self) -> list[PlacedScan]:
        """The scans in the frame of the model, one by one."""
        return placed_scans(self.scanset, self.poses, self.views)

    def scans(self) -> Iterator[OwnScan]:
        """The scans in the frames of their files, one at a time, with ``T_model_scan``."""
        for scan in placed(self.scanset, self.poses):
            motion = self.scanset.motions.get(scan.name)
            own = scan if motion is None else scan.moved(se3.invert(motion))
            yield OwnScan(own, self.component.poses[scan.name])

    def filled(self) -> list[str]:
        """What is said of attributes that some of the scans lack."""
        kinds = {name: kind for name, kind in self.kinds.items() if name not in (INDEX, RESIDUAL)}
        lacking: dict[str, list[str]] = {}
        for scan in placed(self.scanset, self.poses):
            for name in kinds.keys() - kinds_of(scan).keys():
                lacking.setdefault(name, []).append(scan.name)
        return [
            f"{name}: {'NaN' if kinds[name].kind == 'f' else 0} for the points of "
            f"{len(scans)} scan(s) that lack it: {few(scans)}"
            for name, scans in sorted(lacking.items())
        ]


@dataclass(frozen=True, eq=False)
class Clouds:
    """The points of some scans in the frame of the model: gone through as often as need be.

    Parameters
    ----------
    scans : sequence of PlacedScan
    indexed : bool
        With the number of its scan as `INDEX` of each point.
    """

    scans: Sequence[PlacedScan]
    indexed: bool = True

    def __iter__(self) -> Iterator[PointCloud]:
        for cloud in chain.from_iterable(self.scans):
            yield cloud if self.indexed else without_index(cloud)

    @property
    def kinds(self) -> dict[str, np.dtype[Any]]:
        """The attributes by name, and their types."""
        found: dict[str, np.dtype[Any]] = {}
        for scan in self.scans:
            found |= scan.own_kinds
        return {name: kind for name, kind in found.items() if self.indexed or name != INDEX}

    @property
    def probes(self) -> dict[str, Array]:
        """Of each scan that comes in pieces some points (N, 3), from all over it."""
        return {
            one.scan.name: se3.apply(one.pose, some_of(one.scan.points))
            for one in self.scans if one.scan.full is not None
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class OwnScan:
    """One scan in the frame of its file; gone through, its points come in pieces."""

    scan: Scan
    T_model_scan: Array

    def __iter__(self) -> Iterator[PointCloud]:
        kinds = kinds_of(self.scan)
        for points, attributes in pieces_of(self.scan):
            values = {
                name: each.astype(kinds[name], copy=False) for name, each in attributes.items()
            }
            yield PointCloud(
                points, attributes=values, name=self.scan.name, T_world_scan=self.T_model_scan
            )


def without_index(cloud: PointCloud) -> PointCloud:
    """The cloud of one scan, whose number need not be with every point."""
    return replace(cloud, attributes={n: v for n, v in cloud.attributes.items() if n != INDEX})
