"""How densely surfaces are sampled."""

from __future__ import annotations

from collections.abc import Sequence

from mvreg.geometry.nearest import median_positive
from mvreg.parallel import in_threads
from mvreg.types import Scan


def raw_resolution(scans: Sequence[Scan]) -> float:
    """Median over the scans of the `mean_spacing` of their raw points (length)."""
    return median_positive(in_threads(lambda scan: scan.spacing, scans))
