"""What looks wrong with scans before any registration: cheap, from the points alone.

Whether scans are mirrored, or a few per cent too large, shows only in registration: partial views
of an object differ by more.
"""

from __future__ import annotations

from collections.abc import Sequence

from mvreg.datasets.inspection.copies import copies
from mvreg.datasets.inspection.sizes import size_of, strays, units
from mvreg.datasets.inspection.steps import steps
from mvreg.parallel import in_threads
from mvreg.types import Finding, Scan


def inspect_scans(scans: Sequence[Scan]) -> tuple[Finding, ...]:
    """What looks wrong with scans, and what to do about it.

    Parameters
    ----------
    scans : sequence of Scan
        As their files have them.
    """
    sizes = in_threads(size_of, scans)
    return (*units(sizes), *strays(sizes), *copies(scans), *steps(scans))
