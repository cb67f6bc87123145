"""The scans of one or two data sets, prepared together, with and without noise and sensors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

import mvreg
from mvreg.geometry import se3
from mvreg.geometry.nearest import median_spacing
from mvreg.stages.refine.planes import PointToPlane
from mvreg.types import Array, Scan, ScanSet, View

#: Standard deviation along every axis of what "~noise" adds, in mean spacings of the raw points.
NOISE = 1.0
#: Pairs of scans of different objects: as many of them at most.
MOST_FOREIGN = 60


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
}


@dataclass(frozen=True, eq=False)
class Scene:
    """The prepared views of one or two data sets, and their truth, each set's in its own world."""

    views: dict[str, View]
    owner: dict[str, str]
    truth: dict[str, Array]
    pipeline: mvreg.Pipeline

    def relative(self, source: str, target: str) -> Array | None:
        """The true ``T_target_source``, None for scans of different objects."""
        if self.owner[source] != self.owner[target]:
            return None
        return se3.invert(self.truth[target]) @ self.truth[source]


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


def scene(group: str, blind: bool = False) -> Scene:
    """Prepare ``"bunny"`` or ``"bunny+dragon"``; `blind` takes away what scans know of sensors."""
    scans: list[Scan] = []
    owner: dict[str, str] = {}
    truth: dict[str, Array] = {}
    for name in group.split("+"):
        loaded = load_set(name)
        scans += loaded.scans
        owner |= {scan.name: name for scan in loaded.scans}
        truth |= dict(loaded.poses or {})
    if blind:
        scans = [Scan(scan.name, scan.points) for scan in scans]
    pipeline = replace(
        mvreg.load_method("auto", {"seed": "nearest"}).pipeline, refine=PointToPlane()
    )
    views = pipeline.prepare(scans, np.random.default_rng(0))
    return Scene({view.name: view for view in views}, owner, truth, pipeline)


def pairs_of(found: Scene, group: str) -> list[tuple[str, str]]:
    """Which pairs: all of one set, in alternating directions; of two sets some across them."""
    pairs = list(combinations(found.views, 2))
    if "+" in group:
        pairs = [pair for pair in pairs if found.owner[pair[0]] != found.owner[pair[1]]]
        chosen = np.random.default_rng(1).permutation(len(pairs))[:MOST_FOREIGN]
        pairs = [pairs[index] for index in sorted(chosen)]
    return [(b, a) if index % 2 else (a, b) for index, (a, b) in enumerate(pairs)]
