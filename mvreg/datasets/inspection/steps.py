"""Coordinates that are too coarse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mvreg.datasets.inspection.names import named
from mvreg.datasets.inspection.sizes import SAMPLE
from mvreg.types import Array, Finding, Scan

#: Steps of so large a part of a scan's span are as coarse as a scan of 40,000 points.
COARSE = 1 / 700


def steps(scans: Sequence[Scan]) -> Iterator[Finding]:
    """Scans whose coordinates are so coarse that little is left of the surface."""
    found = [(scan, coarse) for scan in scans if (coarse := _step(scan)) is not None]
    if not found:
        return
    names = tuple(scan.name for scan, _ in found)
    _, (step, largest) = found[0]
    single = largest is not None
    where = f" (single precision at {largest:,.0f})" if largest is not None else ""
    yield Finding(
        "steps", names,
        f"the coordinates of {named(names)} are steps of {step:.4g}{where}, as coarse as the scan "
        "itself",
        "export the files in double precision, or subtract the same offset from all before"
        if single else "export the files with more digits",
    )  # fmt: skip


def _step(scan: Scan) -> tuple[float, float | None] | None:
    """The steps of a scan's coordinates if they are coarse; with what number was rounded to them.

    None in place of the number where it is not for single precision.
    """
    some = scan.points[:: max(1, len(scan.points) // SAMPLE)]
    low, high = some.min(axis=0), some.max(axis=0)
    coarse = COARSE * float(np.linalg.norm(high - low))
    if not coarse > 0 or len(some) < 10:
        return None
    largest = np.abs(some).max(axis=0)
    gaps = np.spacing(largest.astype(np.float32)).astype(np.float64)
    for axis in np.argsort(-gaps).tolist():  # the coarsest first
        if gaps[axis] > coarse and (some[:, axis] == some[:, axis].astype(np.float32)).all():
            return float(gaps[axis]), float(largest[axis])
    steps = [_even(some[:, axis], coarse) for axis in range(3)]
    return (min(steps), None) if all(steps) else None


def _even(values: Array, coarse: float) -> float:
    """The step that all values are multiples of, if it is coarse; else 0."""
    apart = np.diff(np.unique(values))
    apart = apart[apart > 1e-6 * coarse]
    if not len(apart) or apart.min() < coarse:
        return 0.0
    step = float(apart.min())
    return step if np.abs(apart / step - np.rint(apart / step)).max() < 0.01 else 0.0
