"""A sample of points that come piece by piece: as many as wanted, drawn at random, in order."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mvreg.types import Array, Indices


@dataclass(eq=False)
class Sample:
    """At most `most` of the points that were added, each as likely as any other.

    Each point draws a number, and those with the smallest are kept: the same ones whatever the
    pieces, and no more than twice as many are held as are wanted.

    Parameters
    ----------
    most : int
        At least 1.
    count : int
        Points added so far.
    """

    most: int
    count: int = 0
    _parts: list[tuple[Array, Array]] = field(default_factory=list)
    _below: float = np.inf

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.most)

    def add(self, points: Array) -> None:
        """Take notice of more points (N, 3)."""
        draws = self._rng.random(len(points))
        self.count += len(points)
        low = draws < self._below
        self._parts.append((points[low], draws[low]))
        if sum(len(draws) for _, draws in self._parts) > 2 * self.most:
            self._cut()

    def points(self) -> Array:
        """The sample (M, 3), in the order in which the points came."""
        self._cut()
        return self._parts[0][0]

    def _cut(self) -> None:
        """Keep the `most` smallest draws; later ones that are no smaller are not wanted."""
        points = np.concatenate([np.empty((0, 3)), *(part for part, _ in self._parts)])
        draws = np.concatenate([np.empty(0), *(part for _, part in self._parts)])
        if len(draws) > self.most:
            kept = smallest(draws, self.most)
            points, draws = points[kept], draws[kept]
            self._below = float(draws.max())
        self._parts = [(points, draws)]


def smallest(draws: Array, count: int) -> Indices:
    """Where the smallest of some numbers are, in order; at most as many as there are."""
    if count >= len(draws):
        return np.arange(len(draws))
    return np.sort(np.argpartition(draws, count)[:count])


def drawn(count: int, most: int) -> Indices:
    """Which of `count` points a `Sample` keeps."""
    return smallest(np.random.default_rng(most).random(count), most)
