"""Scans of another unit of length, and points far from all others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mvreg.datasets.inspection.names import named
from mvreg.types import Finding, Scan
from mvreg.types.figures import significant

#: Scans are compared by so many of their points.
SAMPLE = 2000
#: Spans of scans of one scene do not leave a gap of such a factor.
GAP = 5.0
#: A factor between units is known by so much.
NEAR = 1.25
#: The larger unit and the smaller one by the factor between them.
UNITS = {
    1000.0: ("metres", "millimetres"), 304.8: ("feet", "millimetres"),
    100.0: ("metres", "centimetres"), 39.37: ("metres", "inches"),
    30.48: ("feet", "centimetres"), 25.4: ("inches", "millimetres"),
    12.0: ("feet", "inches"), 10.0: ("centimetres", "millimetres"),
}  # fmt: skip
#: Points so many times as far from the middle as 99 per cent of the scan are far from all others.
FAR = 20.0


@dataclass(frozen=True)
class Size:
    """How large a scan is.

    Parameters
    ----------
    name : str
    span : float
        The longest side of its bounding box, of the 99 per cent if some points are far away.
    most, last : float
        How far 99 per cent of the points, and the last, are from the middle.
    far : int
        How many are far away from all others.
    """

    name: str
    span: float
    most: float
    last: float
    far: int


def size_of(scan: Scan) -> Size:
    """Measure a scan."""
    some = scan.points[:: max(1, len(scan.points) // SAMPLE)]
    middle = np.median(some, axis=0)
    most = float(np.quantile(np.linalg.norm(some - middle, axis=1), 0.99))
    low, high = scan.points.min(axis=0), scan.points.max(axis=0)
    last, far = float(np.linalg.norm(np.maximum(high - middle, middle - low))), 0
    if last > FAR * most > 0:
        away = np.linalg.norm(scan.points - middle, axis=1)
        last, far = float(away.max()), int((away > FAR * most).sum())
    return Size(scan.name, 2 * most if far else float((high - low).max()), most, last, far)


def units(sizes: Sequence[Size]) -> Iterator[Finding]:
    """Scans whose span is far from that of most: of another unit of length, most likely."""
    known = sorted((size for size in sizes if size.most > 0), key=lambda size: size.most)
    groups: list[list[Size]] = [known[:1]]
    for before, after in pairwise(known):
        if after.most > GAP * before.most:
            groups.append([])
        groups[-1].append(after)
    usual = max(groups, key=lambda group: (len(group), group[-1].most if group else 0.0))
    for group in groups:
        if group is usual:
            continue
        own, other = _middle(group), _middle(usual)
        factor = max(own, other) / min(own, other)
        near = min(UNITS, key=lambda unit: abs(np.log(unit / factor)))
        close = 1 / NEAR < near / factor < NEAR
        larger, smaller = UNITS[near]
        words = f"{larger} beside {smaller}" if own < other else f"{smaller} beside {larger}"
        less = "smaller" if own < other else "larger"
        guess = f" ({near:,.4g} times {less}, as {words})" if close else ""
        names = tuple(size.name for size in sizes if size in group)
        yield Finding(
            "unit", names,
            f"{named(names)} {'spans' if len(names) == 1 else 'span'} "
            f"{significant(_middle(group, 'span'))}, the median scan "
            f"{significant(_middle(usual, 'span'))}: "
            f"another unit?{guess}",
            "bring all files into one unit of length, or leave these out by dataset.pattern",
        )  # fmt: skip


def _middle(group: Sequence[Size], what: str = "most") -> float:
    return float(np.median([getattr(size, what) for size in group]))


def strays(sizes: Sequence[Size]) -> Iterator[Finding]:
    """Scans with points far from all others."""
    where = [size for size in sizes if size.far]
    if not where:
        return
    first, names = where[0], tuple(size.name for size in where)
    points = "1 point is" if first.far == 1 else f"{first.far:,} points are"
    yield Finding(
        "stray", names,
        f"{named(names)}: {points} up to {significant(first.last, 4)} from the middle, 99 per cent "
        f"of the scan within {significant(first.most, 4)}",
        "remove these points if they are no returns",
    )  # fmt: skip
