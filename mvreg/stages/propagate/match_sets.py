"""Propagated seeds: sets of matches, one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mvreg.geometry.arrays import Flags
from mvreg.geometry.ragged import picked
from mvreg.types import Indices


@dataclass(frozen=True, eq=False)
class Spread:
    """Sets of matches, one for each seed, which comes first in it.

    Set s of the `matches` (M, 2) begins at ``ends[s]`` and ends before ``ends[s + 1]``.
    """

    matches: Indices
    ends: Indices

    def __len__(self) -> int:
        return len(self.ends) - 1

    def __getitem__(self, one: int) -> Indices:
        return self.matches[self.ends[one] : self.ends[one + 1]]

    @property
    def sizes(self) -> Indices:
        """How many matches each set has."""
        return np.diff(self.ends)

    def part(self, some: slice) -> Spread:
        """A few sets in a row."""
        first, last = self.ends[some.start], self.ends[some.stop]
        return Spread(self.matches[first:last], self.ends[some.start : some.stop + 1] - first)

    def at_least(self, least: int) -> Spread:
        """The sets of so many matches or more."""
        kept = self.sizes >= least
        if kept.all():
            return self
        rows, ends = picked(self.ends, kept)
        return Spread(self.matches[rows], ends)

    def only(self, kept: Flags) -> Spread:
        """The same sets, of the matches that are kept (M,) alone."""
        if kept.all():
            return self
        before = np.concatenate([[0], np.cumsum(kept)])
        return Spread(self.matches[kept], before[self.ends])
