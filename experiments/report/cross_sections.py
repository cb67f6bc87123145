"""Thin slabs through placed scans, and where in them the scans disagree most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from experiments.common.render import Cloud
from mvreg.types import Array

#: In-plane directions, to the right and up, of the slabs across x, y and z, seen from there.
PLANES = (
    ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
)
#: Slabs tried per direction, between these shares of the extent.
STEPS, FIRST, LAST = 25, 0.15, 0.85
#: Points this many slab thicknesses apart or less are of surfaces that ought to meet.
MEET = 4.0
#: A surface crosses a slab steeply if its normal is less than 45 degrees out of the plane.
STEEP = 0.7071
#: Share of a window's points that must be of such surfaces: others smear into blots.
CLEAR = 0.9


@dataclass(frozen=True, eq=False)
class Section:
    """One scan in a slab.

    `points` (M, 2) and unit `normals` (M, 2) are in the plane; `steep` (M,) says where the surface
    crosses the slab steeply.
    """

    points: Array
    normals: Array
    steep: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.points)


#: Each scan in a slab, by the scan's name.
Cut = Mapping[str, Section]


@dataclass(frozen=True, eq=False)
class Slab:
    """The points within half of `thickness` of a plane.

    The plane goes through `origin` (3,); `axes` (2, 3) are unit vectors in it, to the right and up.
    """

    origin: Array
    axes: Array
    thickness: float

    @property
    def normal(self) -> Array:
        """Towards the eye."""
        normal: Array = np.cross(self.axes[0], self.axes[1])
        return normal

    def cut(self, cloud: Cloud) -> Section:
        """Those points of a cloud that lie in the slab, projected onto the plane."""
        offsets = cloud.points - self.origin
        inside = np.abs(offsets @ self.normal) <= self.thickness / 2
        normals = cloud.normals[inside]
        flat = normals @ self.axes.T
        length = np.linalg.norm(flat, axis=1, keepdims=True)
        steep = np.abs(np.asarray(normals @ self.normal)) < STEEP
        return Section(offsets[inside] @ self.axes.T, flat / np.maximum(length, 1e-12), steep)


@dataclass(frozen=True, eq=False)
class Window:
    """A square part of a plane: its `centre` (2,) and half its side."""

    centre: Array
    half: float

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Which of the points (M, 2) are inside."""
        inside: NDArray[np.bool_] = np.max(np.abs(points - self.centre), axis=1) <= self.half
        return inside


def choose_slab(clouds: Sequence[Cloud], thickness: float) -> Slab:
    """The slab across x, y or z in which the scans overlap most, of surfaces that cross it steeply.

    Counted in squares of four thicknesses: the scans in a square beyond the first.
    """
    low = np.min([cloud.points.min(axis=0) for cloud in clouds], axis=0)
    high = np.max([cloud.points.max(axis=0) for cloud in clouds], axis=0)
    slabs = []
    for axis, share in product(range(3), np.linspace(FIRST, LAST, STEPS)):
        origin = (low + high) / 2
        origin[axis] = low[axis] + share * (high[axis] - low[axis])
        slabs.append(Slab(origin, np.array(PLANES[axis]), thickness))
    return max(slabs, key=lambda slab: overlap([slab.cut(c) for c in clouds], MEET * thickness))


def overlap(sections: Sequence[Section], side: float) -> int:
    """Summed over squares: the scans with steep surface in it, beyond the first."""
    cells = [np.unique(np.floor(s.points[s.steep] / side), axis=0) for s in sections]
    _, counts = np.unique(np.concatenate(cells), axis=0, return_counts=True)
    return int((counts - 1).sum())


def spread(cut: Cut, reach: float) -> tuple[Array, Array]:
    """The distance between the scans' surfaces at each point where they cross the slab steeply.

    Returns
    -------
    points : (P, 2) array
        Those that another scan comes within `reach` of, facing the same way.
    distances : (P,) array
        Along the normal, to the nearest point of each such scan; the largest of them.
    """
    steep = {name: s for name, s in cut.items() if s.steep.any()}
    trees = {name: cKDTree(s.points[s.steep]) for name, s in steep.items()}
    points, distances = [np.empty((0, 2))], [np.empty(0)]
    for name, own in steep.items():
        here, normals = own.points[own.steep], own.normals[own.steep]
        apart = np.full(len(here), -1.0)
        for other in steep.keys() - {name}:
            target = steep[other]
            found, partner = trees[other].query(here, distance_upper_bound=reach)
            met = np.flatnonzero(np.isfinite(found))
            there = np.flatnonzero(target.steep)[partner[met]]
            same = (normals[met] * target.normals[there]).sum(axis=1) > STEEP
            met, there = met[same], there[same]
            gaps = np.abs(((target.points[there] - here[met]) * normals[met]).sum(axis=1))
            apart[met] = np.maximum(apart[met], gaps)
        points.append(here[apart >= 0])
        distances.append(apart[apart >= 0])
    return np.concatenate(points), np.concatenate(distances)


def choose_window(cuts: Sequence[Cut], half: float, reach: float) -> Window:
    """The part of the plane in which the worst of several results disagrees most with itself.

    The worst is the one with the largest mean `spread`. Left out are windows with fewer
    points than is usual, and those where surfaces lie in the slab rather than cross it.
    """
    spreads = [spread(cut, reach) for cut in cuts]
    worst = int(np.argmax([distances.mean() if len(distances) else 0 for _, distances in spreads]))
    points, distances = spreads[worst]
    sections = [section for section in cuts[worst].values() if len(section)]
    if not len(points):
        everything = np.concatenate([np.zeros((1, 2)), *(s.points for s in sections)])
        return Window(np.median(everything, axis=0), half)
    every = np.concatenate([section.points for section in sections])
    steep = np.concatenate([section.steep for section in sections])
    cells, cell = np.unique(np.round(points / (half / 2)), axis=0, return_inverse=True)
    windows = [Window(points[cell == index].mean(axis=0), half) for index in range(len(cells))]
    inside = np.array([window.holds(points) for window in windows])
    counts = inside.sum(axis=1)
    clear = np.array([steep[w.holds(every)].mean() for w in windows]) >= CLEAR
    usual = counts >= np.median(counts)
    means = inside @ distances / np.maximum(counts, 1)
    return windows[int(np.argmax(means + 1e3 * (means.max() or 1.0) * (1.0 * usual + clear)))]
