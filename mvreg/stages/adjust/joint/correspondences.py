"""Correspondences between the surfaces of placed scans: pairs of scans, and of their patches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mvreg.geometry.arrays import Places
from mvreg.geometry.boxes import near_boxes
from mvreg.geometry.ragged import ends_of, picked
from mvreg.kernels import contacts as kernel
from mvreg.kernels import overlap
from mvreg.kernels.results import PatchContacts
from mvreg.parallel import Answer, in_threads, slices
from mvreg.stages.adjust.joint.surface import Surface
from mvreg.types import Array, Indices

#: Contacts of a pair of scans, at least: twice as many as a motion has degrees of freedom.
FEWEST = 12
#: Cosine between the normals of a contact, at least. From far off, normals differ by the motion
#: and 45 degrees are few; near the end they differ by noise and where a surface bends. With 0.95
#: the poorest normals, of the best-placed grazing rays, are lost; with 0.7 sides of an edge meet.
LEAST_COSINE, FLAT_LEAST_COSINE = 0.9, 0.7
#: Contacts in a tile, or as many as one way has if that is more: rows of 100 bytes each then fit
#: into the cache of a core. Of fewer contacts there are so many tiles, for threads to share.
TILE, LEAST_TILES = 2**14, 16


@dataclass(frozen=True, eq=False)
class Contacts:
    """Samples of scans that lie on patches of other scans, one ordered pair of scans after another.

    Parameters
    ----------
    ways : (W, 2) array
        The ordered pairs: positions of the scan of the samples (source), and of that of the patches
        (target).
    ends : (W + 1,) array
        Where the contacts of each way begin, and where those of the last one end.
    samples, patches : (M,) arrays
        Positions in the surfaces of the two scans.
    weights : (M,) array
        How much of what is known about the surface each one stands for (1 / length^2); see
        `mvreg.stages.adjust.joint.weighting`. Ones, that take no memory, as they are found.
    """

    ways: Indices
    ends: Indices
    samples: Places
    patches: Places
    weights: Array

    @property
    def counts(self) -> Indices:
        """(W,): how many contacts each way has."""
        return np.diff(self.ends)

    def some(self, chosen: NDArray[np.bool_]) -> Contacts:
        """The contacts of those ways (W,) that are chosen."""
        if chosen.all():
            return self
        kept, ends = picked(self.ends, chosen)
        return self._of(self.ways[chosen], ends, kept)

    def rows(self, part: slice) -> slice:
        """Where the contacts of consecutive ways are."""
        return slice(int(self.ends[part.start]), int(self.ends[part.stop]))

    def parts(self) -> list[slice]:
        """The ways in parts with about as many contacts in each; the same for any threads."""
        size, count = len(self.samples), len(self.ways)
        wanted = np.linspace(0, size, max(LEAST_TILES, size // TILE) + 1)[1:-1]
        ends = np.unique([0, *np.searchsorted(self.ends[:-1], wanted).tolist(), count])
        return [slice(*pair) for pair in pairwise(ends.tolist())]

    def tile(self, part: slice) -> Contacts:
        """The contacts of consecutive ways."""
        ends = self.ends[part.start : part.stop + 1]
        return self._of(self.ways[part], ends - ends[0], slice(ends[0], ends[-1]))

    def in_tiles(self, function: Callable[[Contacts], Answer]) -> list[Answer]:
        """What a function says of some of the ways at a time, in their order; in threads."""
        return in_threads(lambda part: function(self.tile(part)), self.parts())

    def thinned(self, most: int) -> Contacts:
        """Every n-th of the contacts, so that there are no more than `most`."""
        step = max(1, -(-len(self.samples) // most))
        if step == 1:
            return self
        return self._of(self.ways, -(-self.ends // step), slice(None, None, step))

    def _of(self, ways: Indices, ends: Indices, rows: slice | NDArray[np.bool_]) -> Contacts:
        """Some of the contacts. A mask would copy ones that take no memory."""
        samples = self.samples[rows]
        weights = self.weights[rows] if any(self.weights.strides) else _ones(len(samples))
        return Contacts(ways, ends, samples, self.patches[rows], weights)


@dataclass(frozen=True, eq=False)
class Gate:
    """Which contacts count: those closer than `reach` (length), of every `stride`-th sample.

    The cosine between the normals must be above `least_cosine`.

    A `flat` gate asks the tangent planes of patches however far away from their middle, one that is
    not asks the curved patches, no farther along than their raw points reach.
    """

    reach: float
    stride: int = 1
    flat: bool = False
    least_cosine: float = LEAST_COSINE


def touching(surfaces: Sequence[Surface], motions: Array, reach: float) -> list[tuple[int, int]]:
    """Pairs i < j of placed scans whose boxes in the model frame come within `reach` (length)."""
    placed = zip(surfaces, motions, strict=True)
    corners = [np.stack(overlap.box(s.points, motion)) for s, motion in placed]
    return near_boxes(corners, reach)


def contacts(
    surfaces: Sequence[Surface], motions: Array, pairs: Sequence[tuple[int, int]], gate: Gate
) -> Contacts:
    """The contacts of each of `pairs`, in both directions, for those with enough of them.

    Samples find the nearest patch; it must be whole, their cells usable, and the normals agree. The
    ways come in the order of `pairs`.
    """
    patches = [surface.patches for surface in surfaces]
    oriented = np.array([surface.oriented for surface in surfaces])
    ways = np.array([way for i, j in pairs for way in ((i, j), (j, i))], np.intp).reshape(-1, 2)

    def found(part: slice) -> PatchContacts:
        return kernel.contacts(
            patches, motions, ways[part], gate.reach, gate.stride, gate.flat,
            gate.least_cosine, oriented,
        )  # fmt: skip

    parts = in_threads(found, slices(len(ways), 1))
    counts = np.concatenate([np.diff(part.ends) for part in parts])
    samples = np.concatenate([part.samples for part in parts])
    others = np.concatenate([part.patches for part in parts])
    every = Contacts(ways, ends_of(counts), samples, others, _ones(len(samples)))
    enough = np.repeat(counts.reshape(-1, 2).sum(axis=1) >= FEWEST, 2) & (counts > 0)
    return every.some(enough)


def _ones(count: int) -> Array:
    """Weights (count,) of one that take no memory."""
    return np.broadcast_to(np.float64(1), count)
