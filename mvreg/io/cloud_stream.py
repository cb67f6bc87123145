"""What the writers of clouds share: files replaced whole, and a first look at what is to come."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from mvreg.errors import InputError
from mvreg.geometry.nearest import build_tree, mean_spacing, neighbours_of
from mvreg.io.cloud import PointCloud
from mvreg.types import Array
from mvreg.types.attributes import Values

#: Rows written at a time.
ROWS = 1 << 16


@dataclass(eq=False)
class Survey:
    """How many points there are, and between which values coordinates and attributes lie."""

    count: int = 0
    lower: Array = field(default_factory=lambda: np.full(3, np.inf))
    upper: Array = field(default_factory=lambda: np.full(3, -np.inf))
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)

    def add(self, cloud: PointCloud) -> None:
        """Look at a cloud; NaN among its attributes is passed over."""
        if not len(cloud.points):
            return
        self.count += len(cloud.points)
        self.lower = np.minimum(self.lower, cloud.points.min(axis=0))
        self.upper = np.maximum(self.upper, cloud.points.max(axis=0))
        for name, values in cloud.attributes.items():
            low, high = self.limits.get(name, (np.inf, -np.inf))
            good = values[np.isfinite(values)] if values.dtype.kind == "f" else values
            if len(good):
                self.limits[name] = min(low, good.min().item()), max(high, good.max().item())

    def within(self, name: str, low: float, high: float) -> bool:
        """Whether all values of an attribute that are numbers lie between two."""
        found = self.limits.get(name)
        return found is None or (low <= found[0] and found[1] <= high)


def survey(clouds: Iterable[PointCloud], path: Path) -> Survey:
    """Go through clouds before they are written.

    Raises
    ------
    InputError
        If there is no point; no format has a place for nothing.
    """
    found = Survey()
    for cloud in clouds:
        found.add(cloud)
    if not found.count:
        raise InputError(f"{path}: expected at least one point to write, got none")
    return found


def survey_spacing(
    clouds: Iterable[PointCloud], path: Path, probes: Mapping[str, Array] | None = None
) -> tuple[Survey, float]:
    """As `survey`, and the spacing of the finest scan; 0 where all points are in one place.

    Parameters
    ----------
    clouds : iterable of PointCloud
    path : Path
    probes : mapping of str to (N, 3) array, optional
        Some points of those scans that come as several clouds, by name.
    """
    spacings: list[float] = []
    of_pieces = {name: Probes(points) for name, points in (probes or {}).items()}

    def measured() -> Iterator[PointCloud]:
        for cloud in clouds:
            if cloud.name in of_pieces:
                of_pieces[cloud.name].add(cloud.points)
            else:
                spacings.append(spacing_of(cloud.points))
            yield cloud

    seen = survey(measured(), path)
    spacings += [each.spacing for each in of_pieces.values()]
    return seen, min((each for each in spacings if each > 0), default=0.0)


class Probes:
    """Some points (M, 3) of a scan, and how far each is from the nearest of all, as these come."""

    def __init__(self, points: Array) -> None:
        self.points = points
        self.distances = np.full(len(points), np.inf)

    def add(self, points: Array) -> None:
        """Take notice of more points (N, 3) of the scan."""
        if not (len(points) and len(self.points)):
            return
        distances, _ = neighbours_of(build_tree(points), self.points, min(8, len(points)))
        # Nearer than this they are one and the same, apart from how their motion was rounded.
        same = 16 * np.finfo(np.float64).eps * max(np.abs(points).max(), 1e-300)
        apart = np.where(distances > same, distances, np.inf).min(axis=1)
        self.distances = np.minimum(self.distances, apart)

    @property
    def spacing(self) -> float:
        """Mean distance (length) to the nearest point in another place; 0 where there is none."""
        known = self.distances[np.isfinite(self.distances)]
        return float(known.mean()) if len(known) else 0.0


def some_of(points: Array) -> Array:
    """At most 5000 points, from all over a cloud."""
    return points[:: max(1, -(-len(points) // 5000))]


def spacing_of(points: Array) -> float:
    """Mean distance of a point to the nearest one in another place (length), of the points written.

    Scans are held thinned where they are large: their own spacing is not that of all their points.
    As files round coordinates, several points may be in one place: these are passed over.
    """
    if len(points) < 2:
        return 0.0
    ranks = min(8, len(points))
    distances, _ = neighbours_of(build_tree(points), some_of(points), ranks)
    apart = np.where(distances > 0, distances, np.inf).min(axis=1)
    known = apart[np.isfinite(apart)]
    return float(known.mean()) if len(known) else mean_spacing(points)


def numbered(word: str, taken: Collection[str]) -> str:
    """A word that is not taken: itself, or with the first number that is free, ``word_2``."""
    found, number = word, 1
    while found in taken:
        number += 1
        found = f"{word}_{number}"
    return found


def rows_of(
    cloud: PointCloud, piece: slice, record: np.dtype[Any], labels: Mapping[str, str]
) -> Values:
    """Some points of a cloud as records: three coordinates, and attributes by their label.

    What the cloud lacks is NaN, or 0 where the type is whole.
    """
    points = cloud.points[piece]
    table = np.zeros(len(points), dtype=record)
    for axis, column in zip(record.names or (), points.T, strict=False):
        table[axis] = column
    for name, label in labels.items():
        if name in cloud.attributes:
            table[label] = cloud.attributes[name][piece]
        elif record[label].kind == "f":
            table[label] = np.nan
    return table


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A file to write beside `path` that takes its place once it is whole.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    part = path.with_name(f".{path.stem}.{uuid4().hex[:8]}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
