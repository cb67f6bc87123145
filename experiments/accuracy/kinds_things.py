"""A thin tool in code, nearly its own mirror image front to back, for `kinds`; lengths in mm."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from mvreg.datasets.base import ScanSource
from mvreg.datasets.camera import RangeCamera
from mvreg.datasets.mesh import Mesh
from mvreg.datasets.relief import turned
from mvreg.datasets.sdf import Part, block, ellipsoid, limb
from mvreg.datasets.surfacenets import surface_net
from mvreg.datasets.viewpoints import orbit
from mvreg.types import Array, Scan, ScanSet


@lru_cache(maxsize=8)
def pliers(variant: int) -> Mesh:
    """Pliers 190 mm long and 12 thick: a screw on the front, a nut and a mark on the back."""
    rng = np.random.default_rng([variant, 0x9119])
    bend, reach = rng.uniform(18, 30, 2), rng.uniform(95, 120, 2)
    parts: list[Part] = [ellipsoid((0, 0, 0), (17, 15, 6), blend=4.0)]
    for side, out, end in zip((-1, 1), bend, reach, strict=True):
        handle = [(side * 4, -8, 0), (side * out, -45, 0), (side * (out - 6), -end, 0)]
        parts.append(limb(handle, [5.5, 5.0, 4.5], blend=3.0, steps=5))
        jaw = [(side * 6, 8, 0), (side * 7, 30, 0), (side * 3, 62 + 3 * side, 0)]
        parts.append(limb(jaw, [6.0, 5.0, 2.5], blend=3.0, steps=4))
    slot = turned(float(rng.uniform(20, 70)))
    return Mesh(*surface_net([
        *parts, ellipsoid((0, 0, 5), (7, 7, 3)), block((0, 0, 8.5), (7, 0.8, 1.2), 0.3, slot,
        carve=True), block((0, 0, -5), (5.5, 5.5, 2.8), 0.5, turned(15)),
        block((bend[0] - 40, -55, -4), (2, 8, 1.5), 0.4),
    ], step=1.2))  # fmt: skip


@dataclass(frozen=True)
class Tool(ScanSource):
    """The tool, seen all around by a range camera: from the front, the edge, and the back."""

    scans: int = 12
    points: int = 4_000
    variant: int = 0

    @property
    def name(self) -> str:
        """What it is called."""
        return f"tool_{self.variant}"

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Scan the tool, which stands upright, in steps of 30 degrees."""
        mesh, camera = pliers(self.variant), RangeCamera(self.points, noise=0.06)
        scans, poses = list[Scan](), dict[str, Array]()
        for index in range(self.scans):
            name, lift = f"{self.name}_{index:02d}", (60, 40, 75)[index % 3]
            roll, aside = rng.uniform(-12, 12), rng.uniform(-5, 5)
            pose = orbit(mesh.centre, 450.0, 360 / self.scans * index + aside,
                         lift if index < self.scans / 2 else -lift, roll)  # fmt: skip
            scans.append(camera(mesh, pose, rng, name))
            poses[name] = pose
        return ScanSet(self.name, tuple(scans), "mm", poses)
