"""A run made up for suites of export formats: two components, a scan without a pose, odd names."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from mvreg.export.model import Model
from mvreg.export.placements import Component, Link, Placements
from mvreg.geometry import se3
from mvreg.testing.compare import locked
from mvreg.testing.scans import blob_scans
from mvreg.types import Array, Scan, ScanSet

#: What scans can be called that come from a folder, and from folders within it.
NAMES = ("a scan.ply", "levels/üpper (2).xyz", "b", "away.pcd", "lost.ply")
#: Where the scans are in the world (file units): far off, as maps are.
OFFSET = np.array([651_900.25, 5_184_100.5, 415.125])


@cache
def placed_scanset() -> ScanSet:
    """Five small scans of the blob: with intensities, all but the second with colours and normals.

    The third was moved since it was read.
    """
    rng = np.random.default_rng(11)
    scans, motions = [], {}
    for number, (name, scan) in enumerate(zip(NAMES, blob_scans(5, points=300).scans, strict=True)):
        count = len(scan.points)
        attributes = {"intensity": rng.integers(0, 4000, count).astype(np.uint16)}
        if number != 1:
            attributes |= {c: rng.integers(0, 256, count).astype(np.uint8)
                           for c in ("red", "green", "blue")}  # fmt: skip
            normals = rng.normal(size=(3, count))
            normals /= np.linalg.norm(normals, axis=0)
            attributes |= dict(zip(("nx", "ny", "nz"), normals.astype(np.float32), strict=True))
        named = replace(scan, name=name, attributes=attributes)
        if number == 2:
            motions[name] = se3.random(rng, 30.0)
            named = named.moved(motions[name])
        scans.append(named)
    made: ScanSet = locked(ScanSet("placed", tuple(scans), "mm", motions=motions))
    return made


@cache
def placements_of_a_run() -> Placements:
    """Where they are: three in the first component, one in a second, one without a pose."""
    truth = list((blob_scans(5, points=300).poses or {}).values())
    poses = []
    for pose in truth:
        moved = pose.copy()
        moved[:3, 3] += OFFSET
        poses.append(moved)
    links = (Link(NAMES[1], NAMES[0], 0.99), Link(NAMES[2], NAMES[1], 0.75))
    first = Component(1, NAMES[0], dict(zip(NAMES[:3], poses, strict=False)), links)
    second = Component(2, NAMES[3], {NAMES[3]: np.eye(4)})
    locked([list(first.poses.values()), list(second.poses.values())])
    return Placements(NAMES, (first, second), (NAMES[4],), 3.0)


def model_of(component: Component, placements: Placements) -> Model:
    """The points of a component of `placements_of_a_run`."""
    return Model(placed_scanset(), component, placements)


def as_read(name: str) -> Scan:
    """One of the scans in the frame of its file."""
    scanset = placed_scanset()
    (scan,) = (scan for scan in scanset.scans if scan.name == name)
    motion = scanset.motions.get(name)
    return scan if motion is None else scan.moved(se3.invert(motion))


def points_of(component: Component) -> Array:
    """The points (N, 3) of a component in its frame, by the definition."""
    return np.concatenate(
        [se3.apply(pose, as_read(name).points) for name, pose in component.poses.items()]
    )
