"""The points of one component, scan by scan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mvreg.errors import few
from mvreg.export.placements import Component, Placements
from mvreg.geometry import se3
from mvreg.io import PointCloud
from mvreg.report.model import INDEX, RESIDUAL, kinds_of, model_clouds, model_kinds, placed
from mvreg.types import Array, ScanSet, View


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

    def clouds(self, pieces: bool = False) -> Clouds:
        """The scans in the frame of the model, one at a time, with their number as `INDEX`.

        In `pieces` a large one may come as several clouds.
        """
        return Clouds(self.scanset, self.poses, self.views, pieces)

    def scans(self) -> Iterator[PointCloud]:
        """The scans in the frames of their files, one at a time, with ``T_model_scan``."""
        for scan in placed(self.scanset, self.poses):
            motion = self.scanset.motions.get(scan.name)
            scan = scan if motion is None else scan.moved(se3.invert(motion))
            points, attributes = scan.full() if scan.full else (scan.points, scan.attributes)
            yield PointCloud(
                points, attributes=attributes, name=scan.name,
                T_world_scan=self.component.poses[scan.name],
            )  # fmt: skip

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
    """`model_clouds` that can be gone through again."""

    scanset: ScanSet
    poses: Mapping[str, Array]
    views: Sequence[View] = ()
    pieces: bool = False

    def __iter__(self) -> Iterator[PointCloud]:
        return model_clouds(self.scanset, self.poses, self.views, self.pieces)


def without_index(cloud: PointCloud) -> PointCloud:
    """The cloud of one scan, whose number need not be with every point."""
    return replace(cloud, attributes={n: v for n, v in cloud.attributes.items() if n != INDEX})
