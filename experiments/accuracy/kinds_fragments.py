"""A kitchen in fused fragments, for `kinds`; lengths in m."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.datasets.environments import furniture
from mvreg.datasets.environments.build import box, pillar, put, wall
from mvreg.datasets.environments.instruments import DepthCamera
from mvreg.datasets.environments.plan import Plan
from mvreg.datasets.environments.room import shell
from mvreg.datasets.environments.scene import Scene
from mvreg.datasets.environments.sets import Desk
from mvreg.datasets.environments.solids import Solid
from mvreg.datasets.viewpoints import look_at
from mvreg.geometry import se3
from mvreg.geometry.arrays import Flags
from mvreg.types import Array, Scan, ScanSet


@dataclass(frozen=True)
class Fragments(Desk):
    """A kitchen, in fragments: each 20 depth pictures taken on the move, fused, less what strays.

    No fragment has a sensor of its own; its frame is that of its first picture.
    """

    scans: int = 6
    rays: int = 7_500
    pictures: int = 20
    voxel: float = 0.025

    def scene(self) -> Scene:
        """A kitchen of about 4 by 3.5 m."""
        return kitchen(self.variant)

    def load(self, rng: np.random.Generator) -> ScanSet:
        """Take the pictures around the kitchen, and fuse them."""
        scene, camera = self.scene(), self._instrument()
        assert isinstance(camera, DepthCamera)
        scans, poses = list[Scan](), dict[str, Array]()
        for index in range(self.scans):
            name, taken = f"{self.name}_{index:02d}", self._walk(index, rng)
            back = se3.invert(taken[0])
            points = [se3.apply(back @ pose, camera(scene, pose, rng)) for pose in taken]
            scans.append(Scan(name, fused(points, self.voxel)))
            poses[name] = taken[0]
        return ScanSet(self.name, tuple(scans), "m", poses)

    def _walk(self, index: int, rng: np.random.Generator) -> list[Array]:
        """Poses of the pictures of a fragment: the camera pans and moves about the middle."""
        start = 360 / self.scans * index + rng.uniform(-8, 8)
        found = []
        for share in np.linspace(-0.5, 0.5, self.pictures):
            turn = np.radians(start + 75 * share)
            ahead = np.array([np.cos(turn), np.sin(turn), 0.0])
            eye = np.array([2.0, 1.75, 1.4]) - 0.6 * ahead + rng.normal(scale=0.04, size=3)
            down = np.array([0, 0, -0.25 + 0.2 * np.sin(9 * share)])
            found.append(look_at(eye, eye + ahead + down, float(rng.normal(scale=4))))
        return found


def fused(pictures: list[Array], voxel: float) -> Array:
    """One point for every voxel that three points or more are in: their mean (N, 3)."""
    points = np.concatenate(pictures)
    _, index = np.unique(np.floor(points / voxel).astype(np.int64), axis=0, return_inverse=True)
    count = np.bincount(index.ravel())
    sums = np.column_stack([np.bincount(index.ravel(), points[:, axis]) for axis in range(3)])
    often: Flags = count >= 3
    fused: Array = sums[often] / count[often, None]
    return fused


def kitchen(variant: int) -> Scene:
    """Counters and wall cupboards on two sides, a table, shelves and a fridge."""
    rng = np.random.default_rng([variant, 0xC00C])
    size = np.array([4.0, 3.5]) + rng.uniform(-0.2, 0.2, 2)
    width, depth = size
    plan = Plan(np.zeros(2), size, np.array([[-9.0, -9.0]]))
    solids = shell(np.zeros(2), size, 2.5)
    solids += wall((0, depth), (width, depth), 2.5, [(0.5, 1.8, 1.1, 2.1)])
    solids += wall((width, depth), (width, 0), 2.5)
    solids += wall((width, 0), (0, 0), 2.5, [(0.3, 1.2, 0.001, 2.05)])
    solids += wall((0, 0), (0, depth), 2.5)
    for wide in rng.uniform(0.9, 1.6, 4):
        counter: list[Solid] = [
            box((wide, 0.6, 0.88), (0, -0.3, 0)),
            box((wide, 0.63, 0.04), (0, -0.31, 0.88)),
        ]
        counter += [pillar(rng.uniform(0.05, 0.12), rng.uniform(0.1, 0.3), (x, -0.3, 0.92))
                    for x in rng.uniform(-0.4, 0.4, 2) * wide]  # fmt: skip
        if rng.random() < 0.6:
            counter.append(box((0.8 * wide, 0.35, 0.7), (0, -0.18, 1.45)))
        solids += plan.along_wall(rng, counter, wide, 0.65)
    solids += plan.along_wall(rng, furniture.cupboard(rng, 0.65, 1.8), 0.65, 0.62)
    solids += plan.along_wall(rng, furniture.shelf(rng, 0.8, 1.9), 0.8, 0.34)
    table = furniture.table(rng, 0.9, 0.7) + put(furniture.chair(), 0.1, 0.5)
    solids += put(table, width / 2, depth / 2, turn=float(rng.uniform(0, 90)))
    return Scene(tuple(solids))
