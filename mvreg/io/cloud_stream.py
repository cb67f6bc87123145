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
                self.limits[name] = min(low, float(good.min())), max(high, float(good.max()))

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


def survey_spacing(clouds: Iterable[PointCloud], path: Path) -> tuple[Survey, float]:
    """As `survey`, and the spacing of the finest cloud; 0 where all points are in one place."""
    spacings: list[float] = []

    def measured() -> Iterator[PointCloud]:
        for cloud in clouds:
            spacings.append(spacing_of(cloud.points))
            yield cloud

    seen = survey(measured(), path)
    return seen, min((each for each in spacings if each > 0), default=0.0)


def spacing_of(points: Array) -> float:
    """Mean distance of a point to the nearest one in another place (length), of the points written.

    Scans are held thinned where they are large: their own spacing is not that of all their points.
    As files round coordinates, several points may be in one place: these are passed over.
    """
    if len(points) < 2:
        return 0.0
    ranks = min(8, len(points))
    asked = points[:: -(-len(points) // 5000)]
    distances, _ = neighbours_of(build_tree(points), asked, ranks)
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
