"""A sample of points that come piece by piece: as many as wanted, drawn at random, in order."""

from __future__ import annotations

import numpy as np

from mvreg.types import Array, Indices

#: Beside the points wanted so large a share of them is held until some are dropped.
ROOM = 0.5
#: Rows are moved so many at a time.
BLOCK = 1 << 14


class Sample:
    """At most `most` of the points that were added, each as likely as any other.

    Each point draws a number, and those with the smallest are kept: the same ones whatever the
    pieces. Hardly more are held than are wanted.

    Parameters
    ----------
    most : int
        At least 1.

    Attributes
    ----------
    count : int
        Points added so far.
    """

    def __init__(self, most: int) -> None:
        self.most, self.count = most, 0
        self._rng = np.random.default_rng(most)
        self._below = np.inf
        self._points, self._draws = np.empty((0, 3)), np.empty(0)
        self._held = 0

    def add(self, points: Array) -> None:
        """Take notice of more points (N, 3)."""
        draws = self._rng.random(len(points))
        self.count += len(points)
        wanted = np.flatnonzero(draws < self._below)
        while len(wanted):
            if self._held == len(self._draws):
                self._make_room(len(wanted))
                wanted = wanted[draws[wanted] < self._below]
            some = wanted[: len(self._draws) - self._held]
            end = self._held + len(some)
            self._points[self._held : end] = points[some]
            self._draws[self._held : end] = draws[some]
            self._held, wanted = end, wanted[len(some) :]

    def points(self) -> Array:
        """The sample (M, 3), in the order in which the points came."""
        self._cut()
        return self._points[: self._held].copy()

    def _make_room(self, more: int) -> None:
        """Take more memory, or drop points that are not wanted where enough of it is taken."""
        full = self.most + int(ROOM * self.most) + 1
        if self._held < full:
            size = min(full, max(self._held + more, 2 * self._held))
            # In place where the system can: not beside the old ones.
            self._points.resize((size, 3), refcheck=False)
            self._draws.resize(size, refcheck=False)
        else:
            self._cut()

    def _cut(self) -> None:
        """Keep the `most` smallest draws; later ones that are no smaller are not wanted."""
        if self._held <= self.most:
            return
        draws = self._draws[: self._held]
        kept, end = smallest(draws, self.most), 0
        for first in range(0, len(kept), BLOCK):  # forwards: nothing is overwritten too early
            some = kept[first : first + BLOCK]
            end = first + len(some)
            self._points[first:end] = self._points[some]
            self._draws[first:end] = self._draws[some]
        self._held = end
        self._below = float(self._draws[:end].max())


def smallest(draws: Array, count: int) -> Indices:
    """Where the smallest of some numbers are, in order; at most as many as there are."""
    if count >= len(draws):
        return np.arange(len(draws))
    return np.sort(np.argpartition(draws, count)[:count])


def drawn(count: int, most: int) -> Indices:
    """Which of `count` points a `Sample` keeps."""
    return smallest(np.random.default_rng(most).random(count), most)
