"""The scans behind runs, and where each method put them, in one upright frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import mvreg
from experiments.common.render import Cloud
from experiments.common.style import scan_colours
from mvreg.geometry import se3
from mvreg.surface.normals import Orient, estimate_normals
from mvreg.types import Array, ScanSet

Report = Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Scene:
    """One data set, and what several methods made of it.

    `clouds` are the scans, each in its own frame and in its own colour, by name; `poses` maps
    methods to ``T_scene_scan`` (4, 4) of the scans that they placed; `resolution` is that of the
    registration points (length).
    """

    name: str
    unit: str
    clouds: Mapping[str, Cloud]
    poses: Mapping[str, Mapping[str, Array]]
    resolution: float

    def placed(self, method: str) -> dict[str, Cloud]:
        """The scans that a method placed, in the frame of the scene."""
        poses = self.poses[method]
        return {name: c.moved(poses[name]) for name, c in self.clouds.items() if name in poses}


def load_scene(reports: Mapping[str, Report]) -> Scene:
    """Load the scans that all these runs are of, and bring their poses into one frame.

    The frame is that of the first scan as its sensor saw it: x to the right, y up, z towards the
    sensor. Every result is laid onto it by its own reference scan, where the truth has that.

    Parameters
    ----------
    reports : mapping of method to ``result.json``
        Of the same data set in the same order; at least one.

    Raises
    ------
    InputError
        If the scans are not on this machine.
    """
    first = next(iter(reports.values()))
    scanset = scans_of(first)
    names = [scan.name for scan in scanset.scans]
    anchors = upright(scanset, scans_of(first, order="given", scramble=False))
    colours = dict(zip(names, scan_colours(len(names)), strict=True))
    clouds = {}
    for scan in scanset.scans:
        normals = estimate_normals(scan, scan.points, Orient.auto, 30)
        colour = np.broadcast_to(colours[scan.name], scan.points.shape)
        clouds[scan.name] = Cloud(scan.points, normals, colour)
    poses = {method: in_scene(report, anchors) for method, report in reports.items()}
    return Scene(scanset.name, scanset.unit, clouds, poses, float(first["resolution"]))


def scans_of(report: Report, **changes: object) -> ScanSet:
    """The scans of a run, as it was given them; or with other parameters of the data set."""
    config = dict(report["config"]["dataset"])
    config.pop("name", None)
    config.update(changes)
    return mvreg.dataset(str(report["dataset"]), rng=int(report["rng"]), **config)


def upright(scanset: ScanSet, given: ScanSet) -> Mapping[str, Array]:
    """Where the truth has each scan (4, 4), in the frame of the first that was given."""
    names = [scan.name for scan in scanset.scans]
    if scanset.poses is None or given.poses is None:
        return {names[0]: np.eye(4)}
    first = next(scan.name for scan in given.scans if scan.name in given.poses)
    T_scene_world = se3.invert(given.poses[first])
    return {name: T_scene_world @ pose for name, pose in scanset.poses.items() if name in names}


def in_scene(report: Report, anchors: Mapping[str, Array]) -> dict[str, Array]:
    """A run's poses ``T_scene_scan``, with the first placed scan of the anchors where it is."""
    poses = {name: np.array(pose) for name, pose in report["poses"].items()}
    candidates = [report["reference"], *anchors]
    anchor = next((name for name in candidates if name in anchors and name in poses), None)
    if anchor is None:
        return poses
    T_scene_model = anchors[anchor] @ se3.invert(poses[anchor])
    return {name: T_scene_model @ pose for name, pose in poses.items()}
