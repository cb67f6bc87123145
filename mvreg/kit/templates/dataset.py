"""Scans to register: ``dataset=nameless``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.errors import check_positive
from mvreg.geometry import Array, se3
from mvreg.types import Scan, ScanSet

#: Size of the body, and how many bumps it has.
RADIUS, BUMPS = 50.0, 60


@dataclass(frozen=True)
class NamelessDataset:
    """A body with bumps, seen from all around by a camera far away; poses are exact.

    Put your own loading in place of it: files, a camera, a simulation.

    Parameters
    ----------
    views : int
        Number of scans, evenly around the body.
    points : int
        Points on the whole body; each scan has about a third of them.
    """

    views: int = 8
    points: int = 12_000

    def __post_init__(self) -> None:
        check_positive("dataset", views=self.views, points=self.points)

    def __call__(self, rng: np.random.Generator) -> ScanSet:
        """Scan the body; the scans are the same whatever `rng` is.

        Returns
        -------
        ScanSet
            Scans in mm, each in the frame of its camera, and their poses ``T_world_scan``.
        """
        scans, poses = [], {}
        for index in range(self.views):
            name = f"nameless_{index:02d}"
            poses[name] = camera_pose(2 * np.pi * index / self.views, 0.3 * (-1) ** index)
            own = np.random.default_rng(index)  # no two scans hit the same points
            directions = own.normal(size=(self.points, 3))
            directions /= np.linalg.norm(directions, axis=1, keepdims=True)
            towards = poses[name][:3, 2]
            seen = directions[directions @ towards > 0.3]
            there = se3.apply(se3.invert(poses[name]), radius(seen)[:, None] * seen)
            scans.append(Scan(name, there, view_direction=np.array([0.0, 0.0, 1.0])))
        return ScanSet("nameless", tuple(scans), "mm", poses)


def radius(directions: Array) -> Array:
    """How far the surface is from the centre (N,), in mm, in unit `directions` (N, 3)."""
    rng = np.random.default_rng(7)
    centres = rng.normal(size=(BUMPS, 3))
    centres /= np.linalg.norm(centres, axis=1, keepdims=True)
    heights, widths = rng.uniform(0.05, 0.2, BUMPS), rng.uniform(0.02, 0.15, BUMPS)
    away = 1 - directions @ centres.T
    found: Array = RADIUS * (1 + (heights * np.exp(-away / widths)).sum(axis=1))
    return found


def camera_pose(azimuth: float, elevation: float) -> Array:
    """``T_world_scan`` (4, 4) of a camera that looks at the centre against its own +z; radians."""
    z = np.array([
        np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)
    ])  # fmt: skip
    x = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return se3.from_parts(np.stack([x, np.cross(z, x), z], axis=1), np.zeros(3))
