"""Scans of the same points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from mvreg.types import Array, Finding, Scan

#: Radii about the centre of two scans of the same points differ by less (RMS radii).
SAME = 1e-4
#: Of the radii of a scan, in order, about so many are compared.
RADII = 5000


def copies(scans: Sequence[Scan]) -> Iterator[Finding]:
    """Scans of the same points as another, maybe moved, of another size, or mirrored."""
    by_count: dict[int, list[Scan]] = {}
    for scan in scans:
        by_count.setdefault(len(scan.points), []).append(scan)
    for alike in by_count.values():
        radii: list[tuple[Scan, Array, float]] = []
        for scan in alike if len(alike) > 1 and len(alike[0].points) >= 10 else ():
            own, size = _radii(scan)
            of = next((each for each in radii if np.abs(each[1] - own).max() < SAME), None)
            if size > 0 and of is None:
                radii.append((scan, own, size))
            elif size > 0 and of is not None:
                change = _change(scan, of[0], size / of[2])
                yield Finding(
                    "copy", (scan.name, of[0].name),
                    f"{scan.name} has the points of {of[0].name}{change}",
                    "leave one of them out: a copy is no second view",
                )  # fmt: skip


def _radii(scan: Scan) -> tuple[Array, float]:
    """Distances from the centroid in units of their RMS, in order, and that RMS (length).

    Of many points some, evenly from the nearest to the farthest.
    """
    away = np.linalg.norm(scan.points - scan.points.mean(axis=0), axis=1)
    size = float(np.sqrt((away**2).mean()))
    return np.sort(away)[:: max(1, len(away) // RADII)] / (size or 1.0), size


def _change(scan: Scan, of: Scan, factor: float) -> str:
    """How the points of a scan differ from those of another that has the same."""
    if np.array_equal(scan.points, of.points):
        return ""
    if abs(factor - 1) > SAME:
        return f", {factor:.4g} times as large"
    a, b = (each.points - each.points.mean(axis=0) for each in (scan, of))
    left, _, right = np.linalg.svd(a.T @ b)
    rest = float(np.abs(a @ (left @ right) - b).max()) / (float(np.abs(b).max()) or 1.0)
    if rest < 10 * SAME and np.linalg.det(left @ right) < 0:
        return ", mirrored"
    return ", moved"
