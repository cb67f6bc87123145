"""The scans of one or two data sets, prepared together, with and without noise and sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

import mvreg
from experiments.calibration.raw_pairs import LEAST, true_overlap
from mvreg.geometry import se3
from mvreg.geometry.nearest import median_spacing
from mvreg.types import Array, Scan, ScanSet, View

#: Standard deviation along every axis of what "~noise" adds, in mean spacings of the raw points.
NOISE = 1.0
#: As many pairs of a group at most, and of scans of different scenes.
MOST_PAIRS, MOST_FOREIGN = 45, 30
#: If there are more, this share overlaps by the truth; the rest is drawn from those that do not.
OVERLAPPING = 0.7

#: Data sets in the words of `mvreg.dataset`.
SETS: dict[str, tuple[str, dict[str, Any]]] = {
    "bunny": ("bunny", {}),
    "dragon": ("dragon", {}),
    "buddha": ("buddha", {}),
    "armadillo": (
        "armadillo",
        {
            "folders": ["armadillo_partial"],
            "conf": "ArmadilloBack.conf",
            "files": [f"ArmadilloBack_{turn}.ply" for turn in (0, 60, 180, 330)],
        },
    ),
    "figurine": ("figurine", {}),
    "blob-1": ("figurine", {"shape": "blob-1", "views": 8, "points": 20000}),
    "blob-2": ("figurine", {"shape": "blob-2", "views": 8, "points": 20000}),
    "armadillo_virtual": ("armadillo_virtual", {}),
    "rgbd_desk": ("rgbd_desk", {}),
    "lidar_campus": ("lidar_campus", {}),
    "tls_office": ("tls_office", {"sensor": "origin"}),
}
SETS |= {
    f"{name}-{variant}": (name, {"variant": variant})
    for name in ("room", "office", "street", "desk")
    for variant in range(3)
}


@dataclass(frozen=True, eq=False)
class Scene:
    """The prepared views of one or two data sets, and their truth, each set's in its own world.

    `unit` is that of their lengths.
    """

    views: dict[str, View]
    owner: dict[str, str]
    truth: dict[str, Array]
    pipeline: mvreg.Pipeline
    unit: str = "mm"

    def relative(self, source: str, target: str) -> Array | None:
        """The true ``T_target_source``, None for scans of different objects."""
        if self.owner[source] != self.owner[target]:
            return None
        return se3.invert(self.truth[target]) @ self.truth[source]

    def true_overlap(self, source: str, target: str) -> float:
        """The larger share of the two scans that lies on the other by the truth."""
        truth = self.relative(source, target)
        if truth is None:
            return 0.0
        a, b = self.views[source], self.views[target]
        return max(true_overlap(a, b, truth), true_overlap(b, a, se3.invert(truth)))


def load_set(name: str) -> ScanSet:
    """One of `SETS`, without scans that have no truth; ``"bunny~noise"`` with noise added."""
    preset, options = SETS[name.removesuffix("~noise")]
    loaded = mvreg.dataset(preset, **options)
    assert loaded.poses is not None
    scans = [scan for scan in loaded.scans if scan.name in loaded.poses]
    if name.endswith("~noise"):
        rng = np.random.default_rng(2)
        spacing = NOISE * median_spacing([scan.points for scan in scans])
        scans = [
            replace(scan, points=scan.points + spacing * rng.normal(size=scan.points.shape))
            for scan in scans
        ]
    return replace(loaded, scans=tuple(scans))


def scene(group: str, sensor: str = "known") -> Scene:
    """Prepare ``"bunny"`` or ``"bunny+dragon"``.

    `sensor` is what is known of them: "known" is what the scans say, "estimated" takes that away,
    and "none" leaves the normals without orientation, too.
    """
    scans: list[Scan] = []
    owner: dict[str, str] = {}
    truth: dict[str, Array] = {}
    for name in group.split("+"):
        loaded = load_set(name)
        scans += [replace(scan, name=f"{name}/{scan.name}") for scan in loaded.scans]
        owner |= {f"{name}/{scan.name}": name for scan in loaded.scans}
        truth |= {f"{name}/{scan}": pose for scan, pose in (loaded.poses or {}).items()}
    if sensor != "known":
        scans = [Scan(scan.name, scan.points) for scan in scans]
    changes = {"describe.orient": "auto"} if sensor == "none" else {}
    pipeline = mvreg.load_method("auto", changes).pipeline
    views = pipeline.prepare(scans, np.random.default_rng(0))
    return Scene({view.name: view for view in views}, owner, truth, pipeline, loaded.unit)


def pairs_of(found: Scene, group: str) -> list[tuple[str, str]]:
    """Which pairs: all of one set, or evenly some; of two sets some across them.

    In alternating directions.
    """
    pairs = list(combinations(found.views, 2))
    if "+" in group:
        pairs = [pair for pair in pairs if found.owner[pair[0]] != found.owner[pair[1]]]
        pairs = evenly(pairs, MOST_FOREIGN)
    elif len(pairs) > MOST_PAIRS:
        meet = [pair for pair in pairs if found.true_overlap(*pair) >= LEAST]
        apart = [pair for pair in pairs if pair not in set(meet)]
        some = evenly(meet, max(round(OVERLAPPING * MOST_PAIRS), MOST_PAIRS - len(apart)))
        pairs = some + evenly(apart, MOST_PAIRS - len(some))
    return [(b, a) if index % 2 else (a, b) for index, (a, b) in enumerate(pairs)]


def evenly(pairs: list[tuple[str, str]], most: int) -> list[tuple[str, str]]:
    """So many of the pairs at most, drawn at random, in their order."""
    chosen = np.random.default_rng(1).permutation(len(pairs))[:most]
    return [pairs[index] for index in sorted(chosen)]
