"""How often the page of a run under way is written: seldom enough to cost next to nothing."""

from __future__ import annotations

import time

#: Seconds between two pages, at least; and the share of a run's time that they may take.
EVERY, SHARE = 60.0, 0.05
#: Seconds that a page is taken to cost for each scan, before any has been written: on two cores it
#: is a third of that, with scans of 10,000 points. Runs of 300 scans have a page every minute.
SUPPOSED = 0.01


class Pace:
    """Says when the next page is due.

    Parameters
    ----------
    scans : int
        Of the run.
    """

    def __init__(self, scans: int) -> None:
        self._since = time.perf_counter()
        self._cost = SUPPOSED * scans

    def due(self) -> bool:
        """Whether so much time has passed that another page costs no more than its share."""
        return time.perf_counter() - self._since >= max(EVERY, self._cost / SHARE)

    def written(self, started: float) -> None:
        """A page has been written, which was begun at `started` (`time.perf_counter`)."""
        self._since = time.perf_counter()
        self._cost = max(self._cost, self._since - started)
